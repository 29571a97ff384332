#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "calib/number_text.hpp"
#include "render/image_file.hpp"
#include "render/light_blend.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/optics.hpp"
#include "tests/support/referee_program.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::render::light_blend_gl_test {
namespace {

struct Thrower {
  calib::Lens lens;
  Eigen::Vector3d eye, target;
  double lumens = 0, contrast = 0, gamma = 0;
  double max_brightness = 1;

  Rigid<World, Projector> pose() const {
    return test::lookAt<Projector>(eye, target, Eigen::Vector3d::UnitY());
  }
};

/// A rectangle around its frame's origin.
struct Flat {
  std::string name;
  Rigid<World, Surface> T_world_surface;
  Eigen::Vector2d size;

  SurfacePatch patch() const {
    const double x = size.x() / 2, y = size.y() / 2;
    return {name, T_world_surface, {{-x, -y}, {x, -y}, {x, y}, {-x, y}}};
  }
};

Rigid<World, Surface> at(double x, double y, double z, double tilt = 0) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << x, y, z;
  T.linear() = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()).toRotationMatrix();
  return Rigid<World, Surface>(T);
}

Drawable shown(const SurfacePatch& surface, Shape shape, const Color& color) {
  return {Rigid<World, World>(surface.T_world_surface.matrix()), std::move(shape), color};
}

/// A filled area, a path and a cloud all along a surface's x, side by side.
Layer contentOn(const Flat& flat) {
  const float x = static_cast<float>(flat.size.x()) * 0.48f;
  const float y = static_cast<float>(flat.size.y()) * 0.48f;
  Triangles area;
  area.points = {{-x, 0.1f * y, 0}, {x, 0.1f * y, 0}, {x, y, 0},
                 {-x, 0.1f * y, 0}, {x, y, 0},        {-x, y, 0}};
  Lines path;
  path.width = 0.2f * y;
  for (int i = 0; i <= 40; ++i) {
    const float share = static_cast<float>(i) / 20 - 1;
    path.points.emplace_back(share * x, y * (0.06f * std::sin(5 * share) - 0.2f), 0.f);
  }
  PointCloud cloud;
  cloud.size = 0.03f;
  for (float u = -x; u < x; u += 0.02f) {
    for (float v = -y; v < -0.45f * y; v += 0.02f) cloud.points.push_back({u, v, 0});
  }
  Layer layer;
  layer.placement = Placement::Drape;
  layer.surface = flat.patch();
  layer.drawables = {shown(*layer.surface, area, {1, 1, 1, 1}),
                     shown(*layer.surface, path, {0.9f, 0.9f, 0.9f, 1}),
                     shown(*layer.surface, cloud, {0.8f, 0.8f, 0.8f, 1})};
  return layer;
}

class LightBlendTest : public test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    const std::string absence = test::refereeAbsence();
    if (!absence.empty()) GTEST_SKIP() << absence;
  }

  /// Draws the content for each, blended, as well as each alone.
  void draw(const std::vector<Thrower>& throwers, const std::vector<Flat>& flats, Drawing drawing,
            bool evens_black, bool has_content) {
    Scene scene;
    for (const Flat& flat : flats) {
      if (has_content) scene.layers.push_back(contentOn(flat));
      scene.surfaces.push_back(flat.patch());
    }
    std::vector<BlendedProjector> projectors;
    std::vector<std::optional<Rigid<Projector, World>>> poses;
    for (const Thrower& thrower : throwers) {
      projectors.push_back({thrower.lens, thrower.lumens, thrower.max_brightness,
                            thrower.contrast > 0 ? 1 / thrower.contrast : 0});
      poses.emplace_back(thrower.pose().inverse());
    }
    LightBlend blend(projectors, evens_black);
    blend.update(scene.surfaces, poses);
    for (std::size_t i = 0; i < throwers.size(); ++i) {
      ProjectorRenderer renderer(context(), throwers[i].lens, drawing);
      Image image = renderer.render(scene, *poses[i]);
      writePng(folder_.path("asked" + std::to_string(i) + ".png"), image);
      LightSettings settings;
      if (throwers[i].gamma > 0) {
        settings.gamma = {{throwers[i].gamma, throwers[i].gamma, throwers[i].gamma}};
      }
      settings.max_brightness = throwers[i].max_brightness;
      LightOutput(settings, true).apply(image, &blend.light(i));
      writePng(folder_.path("sent" + std::to_string(i) + ".png"), image);
    }
    describe(throwers, flats);
  }

  void describe(const std::vector<Thrower>& throwers, const std::vector<Flat>& flats) {
    std::ofstream file(folder_.path("scene.yaml"));
    file << "projectors:\n";
    for (std::size_t i = 0; i < throwers.size(); ++i) {
      const Thrower& t = throwers[i];
      const Eigen::Map<const Eigen::Matrix<double, 1, 5>> D(t.lens.D.data());
      file << "- {width: " << t.lens.width << ", height: " << t.lens.height
           << ", K: " << calib::yamlNumbers(t.lens.K) << ", D: " << calib::yamlNumbers(D)
           << ", T_world_projector: " << calib::yamlNumbers(t.pose().matrix().matrix())
           << ", lumens: " << t.lumens << ", contrast: " << t.contrast << ", gamma: " << t.gamma
           << ", asked: asked" << i << ".png, sent: sent" << i << ".png}\n";
    }
    file << "surfaces:\n";
    for (const Flat& flat : flats) {
      file << "- {name: " << flat.name << ", size: [" << flat.size.x() << ", " << flat.size.y()
           << "], T_world_surface: " << calib::yamlNumbers(flat.T_world_surface.matrix().matrix())
           << "}\n";
    }
  }

  /// Returns true if it is as bright as asked everywhere; what is not is in the log.
  bool isEven(const std::string& name, const std::string& surface,
              const std::string& options = "") {
    std::string top;
    if (const char* pictures = std::getenv("AFTERGLOW_TEST_PICTURES")) {
      top = " --step-mm 4 --top " + (std::string(pictures) + "/") + name + "_" + surface +
            (options.find("asked") != std::string::npos ? "_before" : "_after") + ".png";
    }
    std::printf("%s, %s %s: ", name.c_str(), surface.c_str(), options.c_str());
    std::fflush(stdout);
    return test::runReferee("judge --scene " + folder_.path("scene.yaml") + " --surface " +
                                surface + " " + options + top,
                            "/dev/stderr", test::kLightSum) == 0;
  }

  void expectEven(const std::string& name, const std::vector<Thrower>& throwers,
                  const std::vector<Flat>& flats,
                  const std::vector<Drawing>& drawings = {Drawing::Cpu}) {
    for (const Drawing drawing : drawings) {
      draw(throwers, flats, drawing, false, true);
      for (const Flat& flat : flats) {
        EXPECT_TRUE(isEven(name, flat.name)) << name << " on the " << flat.name;
        EXPECT_FALSE(isEven(name, flat.name, "--sent asked")) << name << " has no seam";
      }
    }
  }

  test::TempFolder folder_;
};

const calib::Lens kPlain = test::lens(1280, 800, 1100, 640, 400);
const calib::Lens kBent =
    test::lens(1280, 800, 1050, 650, 420, {-0.19, 0.06, 0.0012, -0.0008, -0.01});
const calib::Lens kFine = test::lens(1920, 1080, 1500, 950, 600, {-0.06, 0.02, 0.0008, 0.0005, 0});
const std::vector<Flat> kFloor = {{"floor", at(0, 0, 0), {4, 1.6}}};

TEST_F(LightBlendTest, twoAlikeSideBySideLightTheFloorAsOne) {
  expectEven("two", {{kPlain, {-1, 0, 2.5}, {-1, 0, 0}}, {kPlain, {1, 0, 2.5}, {1, 0, 0}}}, kFloor,
             {Drawing::Cpu, Drawing::Gl});
}

TEST_F(LightBlendTest, threeThatDifferInResolutionBrightnessAndLensDoSoAtAngles) {
  expectEven("three",
             {{kBent, {-1.2, 0, 2.3}, {-1.0, 0, 0}, 2000, 0, 2.0},
              {kFine, {0, -1.2, 2.4}, {0.1, 0, 0}, 3000, 0, 0},
              {kPlain, {1.4, 0.3, 2.5}, {1.0, 0, 0}, 1800, 0, 2.4}},
             kFloor);
}

TEST_F(LightBlendTest, turnedApartTwoDoSoAcrossTheSeamAndBeyondItAsFarAsEachReaches) {
  // Far out each light falls off below that of the darkest place that both reach.
  draw({{kBent, {-0.5, 0, 2.3}, {-1, 0, 0}, 2000, 0, 2.0},
        {kFine, {0.5, 0, 2.4}, {1, 0, 0}, 3000, 0, 0}},
       kFloor, Drawing::Cpu, false, true);
  EXPECT_TRUE(isEven("apart", "floor", "--reach"));
  EXPECT_FALSE(isEven("apart", "floor"));
  EXPECT_FALSE(isEven("apart", "floor", "--reach --sent asked"));
}

TEST_F(LightBlendTest, onATableAndBesideItsShadowsTwoDoSo) {
  expectEven("table",
             {{kBent, {-1.7, -0.2, 2.4}, {-1.2, 0, 0.1}, 2000, 0, 0},
              {kFine, {1.8, 0.2, 2.5}, {1.15, 0, 0.1}, 2400, 0, 2.2}},
             {{"floor", at(0, 0, 0), {3, 1.4}}, {"table", at(0.1, 0.1, 0.5, 0.1), {1.2, 0.5}}});
}

TEST_F(LightBlendTest, blackIsAsBrightWhereOneLightsAsWhereSeveralDo) {
  // A value of 8 bits is a coarse step of light so dark: 15 % is what is within reach.
  const std::vector<Thrower> throwers = {{kPlain, {-1, 0, 2.5}, {-1, 0, 0}, 2000, 300, 0},
                                         {kFine, {1, 0, 2.5}, {1, 0, 0}, 2500, 400, 2.2}};
  draw(throwers, kFloor, Drawing::Cpu, true, false);
  EXPECT_TRUE(isEven("black", "floor", "--black --tolerance 0.15"));
  EXPECT_FALSE(isEven("black", "floor", "--black --tolerance 0.15 --sent asked"));
}

}  // namespace
}  // namespace afterglow::render::light_blend_gl_test
