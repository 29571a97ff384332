#include "nodes/projector/projector_config.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "calib/color/color.hpp"
#include "calib/color/texture.hpp"
#include "nodes/projector/output_config.hpp"
#include "nodes/tools/yaml_map.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::projector_config_test {
namespace {

const std::string kHead =
    "fixed_frame: map\n"                                          // line 1
    "projector: {camera_info: p.yaml, frame: optical}\n"          // line 2
    "surfaces:\n"                                                 // line 3
    "  floor: {frame: map, polygon: [[0, 0], [1, 0], [0, 1]]}\n"  // line 4
    "layers:\n";                                                  // line 5
const std::string kCloud = "  - {topic: /cloud, type: sensor_msgs/PointCloud2";
const std::string kMarker = "  - {topic: /marker, type: visualization_msgs/Marker";

class ProjectorConfigTest : public ::testing::Test {
 protected:
  ProjectorConfig load(const std::string& text, const std::string& calibration = "") {
    std::ofstream(path_) << text;
    return loadProjectorConfig(path_, calibration);
  }
  /// The message without the file's name.
  std::string fault(const std::string& text) {
    try {
      load(text);
    } catch (const std::runtime_error& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.rfind(path_, 0), 0u) << message;
      return message.substr(path_.size());
    }
    return "no fault";
  }

  test::TempFolder folder_;
  std::string path_ = folder_.path("projector.yaml");
};

TEST_F(ProjectorConfigTest, keepsAllButALatencyThatIsWritten) {
  const std::string flow =
      "fixed_frame: map  # where all is\n"
      "projector: {camera_info: lens.yaml, frame: projector_frame}\n"
      "layers:\n  - {topic: /green, type: sensor_msgs/PointCloud2}\n";
  const std::string block =
      "fixed_frame: map\nprojectors:\n  left:\n    camera_info: left.yaml\n"
      "    # the lens\n    frame: left_frame\n  right:\n    latency_ms: 7  # guessed\n"
      "    frame: right_frame\n    camera_info: right.yaml\n"
      "layers:\n  - {topic: /green, type: sensor_msgs/PointCloud2}\n";
  const auto written = [&](const std::string& text, const std::string& name, double ms) {
    load(text);
    writeLatency(path_, name, ms);
    std::ifstream file(path_);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  std::string text = written(flow, "", 41.26);
  EXPECT_EQ(text.substr(0, text.find("layers")),
            "fixed_frame: map  # where all is\n"
            "projector: {camera_info: lens.yaml, latency_ms: 41.3, frame: projector_frame}\n");
  EXPECT_EQ(load(text).projectors[0].latency_ns, 41'300'000);
  EXPECT_EQ(load(written(text, "", 8)).projectors[0].latency_ns, 8'000'000);
  text = written(block, "left", 20);
  EXPECT_NE(text.find("    # the lens\n    latency_ms: 20.0\n    frame: left_frame\n"),
            std::string::npos)
      << text;
  EXPECT_NE(written(text, "right", 30).find("latency_ms: 30.0  # guessed\n"), std::string::npos);
  EXPECT_THROW(written(block, "", 20), std::runtime_error);
  EXPECT_THROW(written(block, "middle", 20), std::runtime_error);
  EXPECT_THROW(written(flow, "", 501), std::runtime_error);
}

TEST_F(ProjectorConfigTest, readsTheWholeOfADesignersExample) {
  const ProjectorConfig config = load(
      "fixed_frame: map\n"
      "projector: {camera_info: projector.yaml, frame: projector_optical_frame, latency_ms: 12.5,"
      " drawing: cpu}\n"
      "surfaces:\n"
      "  floor: {frame: map, polygon: [[-2, -2], [2, -2], [2, 2], [-2, 2]]}\n"
      "  table: {frame: table, gain: 0.5}\n"
      "layers:\n"
      "  - {topic: /green, type: sensor_msgs/PointCloud2, style: boxes, size: 0.006,"
      " color: \"#00ff00\", placement: direct}\n"
      "  - {topic: /nav/path, type: visualization_msgs/MarkerArray, surface: floor,"
      " placement: drape, alpha: 0.5}\n"
      "  - {topic: /scan, type: sensor_msgs/LaserScan, color: [206, 92, 0], style: points}\n"
      "  - {topic: /plan, type: nav_msgs/Path, size: 0.05, surface: table, placement: viewer,"
      " viewer: {frame: head, position: [0, 0.5, 1]}}\n"
      "  - {topic: /depth, type: sensor_msgs/PointCloud2, color: axis_z}\n",
      "/calibration");
  EXPECT_EQ(config.fixed_frame, "map");
  ASSERT_EQ(config.projectors.size(), 1u);
  EXPECT_EQ(config.projectors[0].camera_info, "/calibration/projector.yaml");
  EXPECT_EQ(config.projectors[0].frame, "projector_optical_frame");
  EXPECT_EQ(config.projectors[0].latency_ns, 12'500'000);
  EXPECT_EQ(config.projectors[0].drawing, render::Drawing::Cpu);
  ASSERT_EQ(config.surfaces.size(), 2u);
  EXPECT_EQ(config.surfaces[0].polygon.at(1), Eigen::Vector2d(2, -2));
  EXPECT_TRUE(config.surfaces[1].polygon.empty());
  EXPECT_EQ(config.surfaces[0].gain, 1);
  EXPECT_EQ(config.surfaces[1].gain, 0.5f);
  ASSERT_EQ(config.layers.size(), 5u);
  EXPECT_EQ(config.layers[0].cloud.style, render::PointStyle::Boxes);
  EXPECT_EQ(config.layers[0].cloud.size, 0.006f);
  EXPECT_EQ(config.layers[0].flat_color, (render::Color{0, 1, 0, 1}));
  EXPECT_EQ(config.layers[1].type, LayerType::MarkerArray);
  EXPECT_EQ(config.layers[1].placement, render::Placement::Drape);
  EXPECT_EQ(config.layers[1].surface, 0u);
  EXPECT_EQ(config.layers[1].alpha, 0.5f);
  EXPECT_EQ(config.layers[2].cloud.size, 3);  // pixels
  EXPECT_EQ(config.layers[2].flat_color, (render::Color{206 / 255.0f, 92 / 255.0f, 0, 1}));
  EXPECT_EQ(config.layers[3].path.width, 0.05f);
  EXPECT_EQ(config.layers[3].surface, 1u);
  ASSERT_TRUE(config.layers[3].viewer);
  EXPECT_EQ(config.layers[3].viewer->p_frame, Eigen::Vector3d(0, 0.5, 1));
  EXPECT_EQ(config.layers[4].cloud.color, ColorSource::AxisZ);
  EXPECT_EQ(config.layers[4].cloud.size, 0.01f);
}

TEST_F(ProjectorConfigTest, readsTheExampleThatIsShipped) {
  const ProjectorConfig config = loadProjectorConfig("assets/projector.yaml", "calibration");
  EXPECT_EQ(config.projectors.at(0).camera_info, "calibration/projector.yaml");
  EXPECT_EQ(config.layers.size(), 5u);
}

TEST_F(ProjectorConfigTest, findsTheLensBesideItselfWithoutACalibrationFolder) {
  EXPECT_EQ(load(kHead + kCloud + "}\n").projectors.at(0).camera_info, folder_.path("p.yaml"));
}

TEST_F(ProjectorConfigTest, isNotItsOwnLens) {
  const std::string itself =
      "fixed_frame: map\nprojector: {camera_info: projector.yaml, frame: optical}\n";
  const std::string said = fault(itself + "layers:\n" + kCloud + ", surface: floor}\n");
  EXPECT_NE(said.find("names this configuration itself"), std::string::npos) << said;
  EXPECT_NE(said.find("--calibration"), std::string::npos) << said;
}

TEST_F(ProjectorConfigTest, refusesALensOfMorePixelsThanAreDrawn) {
  const auto refusal = [&](int width, int height) -> std::string {
    std::ofstream(folder_.path("p.yaml"))
        << "{width: " << width << ", height: " << height
        << ", distortion_model: '', D: [], K: [500, 0, 320, 0, 500, 240, 0, 0, 1]}";
    OutputConfig output;
    output.camera_info = folder_.path("p.yaml");
    try {
      loadLens(output);
    } catch (const std::runtime_error& error) {
      return std::string(error.what()).substr(output.camera_info.size());
    }
    return "";
  };
  EXPECT_EQ(refusal(7680, 4320), "") << "8K UHD";
  EXPECT_EQ(refusal(8192, 4097),
            ": a picture of 8192 x 4097 pixels: a projector's has at most 33 million");
  EXPECT_NE(refusal(65535, 65535).find("expected at most 16384 pixels a side"), std::string::npos);
}

// tf2 knows names without a slash before them, and warns of others each time it is asked.
TEST_F(ProjectorConfigTest, takesFramesWithoutTheirOldSlashAndRefusesOthers) {
  std::string text = kHead + kMarker + "}\n";
  text.replace(text.find("map"), 3, "/map");
  EXPECT_EQ(load(text).fixed_frame, "map");
  text.replace(text.find("/map"), 4, "//map");
  EXPECT_EQ(fault(text), ":1: 'fixed_frame' of the configuration is no frame's name: '//map'");
  text = kHead + kMarker + "}\n";
  text.replace(text.find("optical"), 7, "'/'");
  EXPECT_EQ(fault(text), ":2: 'frame' of 'projector' is no frame's name: '/'");
}

TEST_F(ProjectorConfigTest, namesTheLineAndTheNearestKeyOfATypo) {
  EXPECT_EQ(fault(kHead + kCloud + "}\n" + kMarker + ", colour: red}\n"),
            ":7: unknown key 'colour' in layer 2; did you mean 'color'?");
  EXPECT_EQ(fault("fixed_fram: map\n"),
            ":1: unknown key 'fixed_fram' in the configuration; did you mean 'fixed_frame'?");
  EXPECT_EQ(fault(kHead + kCloud + ", wavelength: 5}\n"),
            ":6: unknown key 'wavelength' in layer 1; known: topic, type, style, size, color, "
            "alpha, decay, placement, surface, viewer, reader, pose_style, axes, arrows, "
            "buffer_length, offset, shape, covariance, keep, position_tolerance, angle_tolerance, "
            "color_scheme, camera_info, distance");
  EXPECT_EQ(fault(kHead + kCloud + ", style: box}\n"),
            ":6: unknown style 'box' in layer 1; did you mean 'boxes'?");
  EXPECT_EQ(fault(kHead + "  - {topic: /a, type: sensor_msgs/PointCloud}\n"),
            ":6: unknown type 'sensor_msgs/PointCloud' in layer 1; did you mean "
            "'sensor_msgs/PointCloud2'?");
  EXPECT_EQ(fault(kHead + kMarker + ", placement: drape, surface: flor}\n"),
            ":6: unknown surface 'flor' in layer 1; did you mean 'floor'?");
}

TEST_F(ProjectorConfigTest, refusesValuesOfTheWrongKind) {
  EXPECT_EQ(fault(kHead + kCloud + ", size: big}\n"),
            ":6: 'size' of layer 1 should be a number from 0.0001 to 1000, not 'big'");
  EXPECT_EQ(fault(kHead + kCloud + ", size: .nan}\n"),
            ":6: 'size' of layer 1 should be a number from 0.0001 to 1000, not '.nan'");
  EXPECT_EQ(fault(kHead + kCloud + ", style: points, size: 0.01}\n"),
            ":6: 'size' of layer 1 should be a number from 1 to 250, not '0.01'");
  EXPECT_EQ(fault(kHead + kCloud + ", alpha: 2}\n"),
            ":6: 'alpha' of layer 1 should be a number from 0 to 1, not '2'");
  EXPECT_EQ(fault(kHead + kCloud + ", color: [1, 2]}\n"),
            ":6: 'color' of layer 1 should be 3 numbers in brackets");
  EXPECT_EQ(fault(kHead + kCloud + ", color: \"#12345g\"}\n"),
            ":6: 'color' of layer 1 should be \"#rrggbb\", [r, g, b], rgb8, mono8, rgbf32, "
            "intensity, axis_x, axis_y, axis_z or a map, not '#12345g'");
  EXPECT_EQ(fault(kHead + kCloud + ", color: [1, 2, 256]}\n"), ":6: a color goes from 0 to 255");
  EXPECT_EQ(fault(kHead + "  - {topic: cloud, type: nav_msgs/Path}\n"),
            ":6: topic 'cloud' should begin with '/'");
  EXPECT_EQ(fault(kHead + "  - just text\n"), ":6: layer 1 should be a map of keys and values");
  EXPECT_EQ(fault("fixed_frame: [map]\nprojector: {camera_info: p, frame: f}\nlayers: []\n"),
            ":1: 'fixed_frame' of the configuration should be a text");
}

TEST_F(ProjectorConfigTest, refusesWhatIsMissingDoubledOrWithoutMeaning) {
  EXPECT_EQ(fault("fixed_frame: map\n"), ":1: no 'projector' in the configuration");
  EXPECT_EQ(fault(kHead), ":6: 'layers' should be a list of at least one layer");
  EXPECT_EQ(fault(kHead + kCloud + "}\n" + kCloud + "}\n"), ":7: topic '/cloud' twice");
  EXPECT_EQ(fault(kHead + kCloud + ", alpha: 1, alpha: 1}\n"), ":6: key 'alpha' twice in layer 1");
  EXPECT_EQ(fault(kHead + kMarker + ", size: 1}\n"),
            ":6: 'size' in layer 1 has no meaning for visualization_msgs/Marker");
  EXPECT_EQ(fault(kHead + "  - {topic: /p, type: nav_msgs/Path, style: boxes}\n"),
            ":6: unknown style 'boxes' in layer 1; known: lines, billboards");
  EXPECT_EQ(fault(kHead + "  - {topic: /p, type: sensor_msgs/LaserScan, color: rgb8}\n"),
            ":6: sensor_msgs/LaserScan has no color 'rgb8'");
  EXPECT_EQ(fault(kHead + kMarker + ", placement: drape}\n"),
            ":6: 'placement' of layer 1 needs a 'surface'");
  EXPECT_EQ(fault(kHead + kMarker + ", surface: floor}\n"),
            ":6: 'surface' in layer 1 has no meaning without placement drape or viewer");
  EXPECT_EQ(fault(kHead + kMarker + ", placement: viewer, surface: floor}\n"),
            ":6: placement viewer of layer 1 needs a 'viewer'");
  EXPECT_EQ(fault("fixed_frame: map\nprojector: {camera_info: p, frame: f}\n"
                  "surfaces: {floor: {frame: map, polygon: [[0, 0], [1, 1]]}}\n"),
            ":3: the polygon of surface 'floor' has no area");
}

TEST_F(ProjectorConfigTest, readsTheBasesCommands) {
  const std::string layers = kHead + kMarker + "}\n";  // 6 lines
  EXPECT_FALSE(load(layers).base);
  const std::string base = "base: {commands: /cmd_vel, linear_acceleration: 0.75, ";
  const BaseConfig read = *load(layers + base + "angular_acceleration: 3, delay_ms: 20}\n").base;
  EXPECT_EQ(read.command_topic, "/cmd_vel");
  EXPECT_EQ(read.frame, "base_link");
  EXPECT_EQ(read.linear_acceleration, 0.75);
  EXPECT_EQ(read.angular_acceleration, 3);
  EXPECT_EQ(read.delay_ns, 20'000'000);
  EXPECT_EQ(fault(layers + base + "}\n"), ":7: no 'angular_acceleration' in 'base'");
  EXPECT_EQ(fault(layers + base + "angular_acceleration: 0}\n"),
            ":7: 'angular_acceleration' of 'base' should be a number from 0.01 to 100, not '0'");
  EXPECT_EQ(fault(layers + "base: {commands: cmd_vel}\n"),
            ":7: 'commands' of 'base' is a topic: it should begin with '/'");
}

TEST_F(ProjectorConfigTest, readsWhoTextIsForAndWhereMeshesComeFrom) {
  const std::string on_floor = kMarker + ", placement: drape, surface: floor";
  const ProjectorConfig person =
      load(kHead + on_floor + ", reader: {frame: person, position: [0, 0, 1]}}\n");
  ASSERT_TRUE(person.layers[0].reader);
  EXPECT_EQ(person.layers[0].reader->frame, "person");
  EXPECT_FALSE(person.layers[0].reader->is_direction);
  const ProjectorConfig side = load(kHead + on_floor + ", reader: [1, 0]}\n" + "mesh_roots: [.]\n");
  ASSERT_TRUE(side.layers[0].reader);
  EXPECT_EQ(side.layers[0].reader->frame, "map");
  EXPECT_TRUE(side.layers[0].reader->is_direction);
  EXPECT_EQ(side.layers[0].reader->p_frame, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(side.mesh_roots, std::vector<std::string>{folder_.path(".")});
  EXPECT_EQ(fault(kHead + on_floor + ", reader: [0, 0]}\n"),
            ":6: 'reader' of layer 1 has no direction");
  EXPECT_EQ(fault(kHead + kMarker + ", reader: [1, 0]}\n"),
            ":6: 'reader' in layer 1 has no meaning without markers and placement drape");
  EXPECT_EQ(fault(kHead + on_floor + "}\nmesh_roots: [/nowhere/meshes]\n"),
            ":7: no such folder in 'mesh_roots': '/nowhere/meshes'");
  EXPECT_EQ(fault(kHead + on_floor + "}\nmesh_roots: /tmp\n"),
            ":7: 'mesh_roots' should be a list of at least one folder");
}

TEST_F(ProjectorConfigTest, readsSeveralProjectorsAndTheirLight) {
  const std::string layers = "layers: [{topic: /c, type: sensor_msgs/PointCloud2}]\n";
  const ProjectorConfig config = load(
      "fixed_frame: map\n"
      "projectors:\n"
      "  left: {camera_info: l.yaml, frame: l, monitor: HDMI-1, mirror: horizontal, gamma: 2.2}\n"
      "  right: {camera_info: r.yaml, frame: r, gamma: [2, 2.1, 2.2], max_brightness: 0.5}\n" +
      layers);
  ASSERT_EQ(config.projectors.size(), 2u);
  EXPECT_EQ(config.projectors[0].name, "left");
  EXPECT_EQ(config.projectors[0].monitor, "HDMI-1");
  EXPECT_EQ(config.projectors[0].light.mirror, render::Mirror::Horizontal);
  EXPECT_EQ(config.projectors[0].light.gamma, (std::array<double, 3>{2.2, 2.2, 2.2}));
  EXPECT_EQ(config.projectors[0].light.max_brightness, 1);
  EXPECT_EQ(config.projectors[1].camera_info, folder_.path("r.yaml"));
  EXPECT_EQ(config.projectors[1].light.gamma, (std::array<double, 3>{2, 2.1, 2.2}));
  EXPECT_EQ(config.projectors[1].light.max_brightness, 0.5);
  const auto faultOf = [&](const std::string& projectors) {
    return fault("fixed_frame: map\n" + projectors + layers);
  };
  const std::string values = "{camera_info: l.yaml, frame: l, monitor: A}";
  EXPECT_EQ(faultOf("projectors: {a: " + values + "}\nprojector: " + values + "\n"),
            ":2: either 'projector' or 'projectors', not both");
  EXPECT_EQ(faultOf("projectors: {}\n"),
            ":2: 'projectors' should map names to at least one projector");
  EXPECT_EQ(faultOf("projectors: {a b: " + values + "}\n"),
            ":2: projector 'a b': a name has letters, digits and '_', and begins with a letter");
  EXPECT_EQ(faultOf("projectors: {a: " + values + ", a: " + values + "}\n"),
            ":2: projector 'a' twice");
  EXPECT_EQ(faultOf("projectors: {a: " + values + ", b: " + values + "}\n"),
            ":2: monitor 'A' twice");
  EXPECT_EQ(faultOf("projectors: {a: {camera_info: l, frame: l, mirror: up}}\n"),
            ":2: unknown mirror 'up' in projector 'a'; known: none, horizontal, vertical, both");
  EXPECT_EQ(faultOf("projector: {camera_info: l, frame: l, gamma: [1, 2, 9]}\n"),
            ":2: a gamma goes from 1 to 4");
  EXPECT_EQ(faultOf("projector: {camera_info: l, frame: l, max_brightness: 2}\n"),
            ":2: 'max_brightness' of 'projector' should be a number from 0 to 1, not '2'");
}

TEST_F(ProjectorConfigTest, readsWhetherAndHowProjectorsShareTheirLight) {
  const std::string layers = "layers: [{topic: /c, type: sensor_msgs/PointCloud2}]\n";
  const std::string floor = "surfaces: {floor: {frame: map}}\n";
  const auto with = [&](const std::string& left, const std::string& right, const std::string& blend,
                        const std::string& surfaces) {
    return "fixed_frame: map\nprojectors:\n  left: {camera_info: l.yaml, frame: l" + left +
           "}\n  right: {camera_info: r.yaml, frame: r" + right + "}\nblend: " + blend + "\n" +
           surfaces + layers;
  };
  EXPECT_FALSE(load(with("", "", "false", floor)).blend);
  const ProjectorConfig plain = load(with("", "", "true", floor));
  ASSERT_TRUE(plain.blend);
  EXPECT_FALSE(plain.blend->evens_black);
  EXPECT_EQ(plain.projectors[0].blended({}).lumens, 0);
  EXPECT_EQ(plain.projectors[0].blended({}).black, 0);
  const ProjectorConfig known = load(with(", lumens: 2000, contrast: 500, max_brightness: 0.5",
                                          ", lumens: 900, contrast: 1000", "{black: true}", floor));
  EXPECT_TRUE(known.blend.value().evens_black);
  EXPECT_EQ(known.projectors[0].blended({}).lumens, 2000);
  EXPECT_EQ(known.projectors[0].blended({}).white, 0.5);
  EXPECT_EQ(known.projectors[0].blended({}).black, 0.002);

  EXPECT_EQ(fault(with("", "", "yes please", floor)),
            ":5: unknown blend 'yes please' in the configuration; known: false, true");
  EXPECT_EQ(fault(with("", "", "{white: true}", floor)),
            ":5: unknown key 'white' in 'blend'; known: black");
  EXPECT_EQ(fault(with("", "", "true", "")),
            ":5: 'blend' needs 'surfaces': where the projectors' light meets");
  EXPECT_EQ(fault(with(", lumens: 2000", "", "true", floor)),
            ":5: projector 'right' has no 'lumens': all of them have it, or none");
  EXPECT_EQ(fault(with(", contrast: 500", "", "{black: true}", floor)),
            ":5: projector 'right' has no 'contrast': its black is not known");
  EXPECT_EQ(fault(with(", contrast: 500", ", contrast: 500", "{black: true}",
                       floor + "avoid: {from: []}\n")),
            ":5: evened black would light what 'avoid' keeps dark");
  EXPECT_EQ(fault(with(", lumens: 0", "", "true", floor)),
            ":3: 'lumens' of projector 'left' should be a number from 1 to 100000, not '0'");
  EXPECT_EQ(fault(kHead + kCloud + "}\nblend: true\n"), ":7: 'blend' is for several 'projectors'");
}

TEST_F(ProjectorConfigTest, readsHowColorsLook) {
  std::vector<calib::ColorSample> samples;
  for (const calib::Rgb& shown : calib::colorsToShow()) {
    // As bright as they are sent, on something yellow.
    samples.push_back({shown, {0.8 * shown[0] / 255, 0.7 * shown[1] / 255, 0.4 * shown[2] / 255}});
  }
  const calib::ColorFit fit = calib::fitColor(samples);
  test::writeFile(folder_.path("color.yaml"), calib::colorYaml(fit));
  const std::string layers = "layers: [{topic: /c, type: sensor_msgs/PointCloud2}]\n";
  const auto with = [&](const std::string& keys) {
    return "fixed_frame: map\nprojector: {camera_info: l, frame: l, " + keys + "}\n" + layers;
  };
  EXPECT_TRUE(load(with("latency_ms: 1")).projectors[0].light.colors.empty());
  EXPECT_EQ(load(with("color: color.yaml, max_brightness: 0.5")).projectors[0].light.colors,
            calib::colorTable(fit.response, 0.5));
  EXPECT_EQ(fault(with("color: color.yaml, gamma: 2")),
            ":2: either 'gamma' or 'color', which measures it, too");
  EXPECT_EQ(fault(with("color: none.yaml")), ":2: " + folder_.path("none.yaml: cannot be read"));
  EXPECT_EQ(fault("fixed_frame: map\nprojectors:\n"
                  "  left: {camera_info: l, frame: l, contrast: 500, color: color.yaml}\n"
                  "  right: {camera_info: l, frame: l, contrast: 500}\n"
                  "blend: {black: true}\nsurfaces: {floor: {frame: map}}\n" +
                  layers),
            ":5: black is evened by 'gamma' or sRGB's curve, and projector 'left' has 'color'");
}

TEST_F(ProjectorConfigTest, readsTheTexturesOfSurfaces) {
  std::vector<calib::ColorSample> samples;
  for (const calib::Rgb& shown : calib::colorsToShow()) {
    samples.push_back({shown, {0.8 * shown[0] / 255, 0.7 * shown[1] / 255, 0.4 * shown[2] / 255}});
  }
  calib::SurfaceTexture texture;
  texture.surface = "floor";
  texture.color = calib::fitColor(samples).response;
  texture.cell = 0.01;
  texture.density = 1;
  texture.columns = texture.rows = 1;
  texture.cells = {{texture.color.M_seen_light.cast<float>(), {0, 0, 0}}};
  calib::saveTexture(folder_.path(""), texture);
  const auto with = [&](const std::string& files, const std::string& surfaces) {
    return "fixed_frame: map\nprojector: {camera_info: l, frame: l, textures: " + files +
           "}\nsurfaces: {" + surfaces +
           "}\nlayers: [{topic: /c, type: sensor_msgs/PointCloud2}]\n";
  };
  const auto textures =
      load(with("[floor_texture.yaml]", "floor: {frame: map}")).projectors[0].light.textures;
  ASSERT_EQ(textures.size(), 1u);
  EXPECT_EQ(textures[0].surface, "floor");
  EXPECT_EQ(fault(with("[floor_texture.yaml]", "table: {frame: map}")),
            ":2: a texture is of surface 'floor', which 'surfaces' does not have");
  EXPECT_EQ(
      fault(with("[floor_texture.yaml]", "floor: {frame: map, find_in: /points, height: [0, 1]}")),
      ":2: surface 'floor' has a texture: it can be neither found ('find_in') nor have a "
      "'relief'");
  EXPECT_EQ(fault(with("[floor_texture.yaml, floor_texture.yaml]", "floor: {frame: map}")),
            ":2: two textures of surface 'floor'");
  EXPECT_EQ(fault(with("floor_texture.yaml", "floor: {frame: map}")),
            ":2: 'textures' should be a list of at least one file");
  EXPECT_EQ(fault(with("[none.yaml]", "floor: {frame: map}")),
            ":2: " + folder_.path("none.yaml: cannot be read"));
  const std::string lens = "camera_info: l, frame: l";
  EXPECT_EQ(fault("fixed_frame: map\nprojectors:\n  left: {" + lens + "}\n  right: {" + lens +
                  ", textures: [floor_texture.yaml]}\nblend: true\n"
                  "surfaces: {floor: {frame: map}}\n"
                  "layers: [{topic: /c, type: sensor_msgs/PointCloud2}]\n"),
            ":5: shares of light are not reckoned on 'textures', which projector 'right' has");
}

TEST_F(ProjectorConfigTest, refusesFilesThatAreNoYaml) {
  EXPECT_EQ(fault("fixed_frame: [map\n").substr(0, 3), ":2:");
  EXPECT_THROW(loadProjectorConfig(folder_.path("none.yaml"), ""), std::runtime_error);
  EXPECT_THROW(loadProjectorConfig(folder_.path(""), ""), std::runtime_error);
  EXPECT_EQ(fault(""), ": the configuration should be a map of keys and values");
}

}  // namespace
}  // namespace afterglow::nodes::projector_config_test
