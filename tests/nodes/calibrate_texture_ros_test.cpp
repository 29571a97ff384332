// `afterglow calibrate texture` as a user meets it, and what is sent by the file that it writes.
// Photographer and judge: the referee of support/textured_room.hpp.
#include <rosbag/bag.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/Marker.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/picture.hpp"
#include "calib/report/calibration_files.hpp"
#include "calib/targets/target_files.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "tests/support/calibrate_command.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/texture_trial.hpp"

namespace afterglow::nodes::calibrate_texture_ros_test {
namespace {

namespace fs = std::filesystem;
using test::TexturedRoom;

const calib::Rgb kAsked = {150, 200, 150};

/// The floor's frame stands anywhere in the map.
Eigen::Isometry3d mapToFloor() {
  Eigen::Isometry3d T_map_floor = Eigen::Isometry3d::Identity();
  T_map_floor.translate(Eigen::Vector3d(2, -1, 0.3));
  T_map_floor.rotate(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()));
  return T_map_floor;
}

geometry_msgs::TransformStamped link(const std::string& parent, const std::string& child,
                                     const Eigen::Isometry3d& T_parent_child) {
  geometry_msgs::TransformStamped link;
  link.header.frame_id = parent;
  link.child_frame_id = child;
  link.transform = toTransform(T_parent_child);
  return link;
}

/// Links of map, floor, camera and projector.
tf2_msgs::TFMessage linksOf(const TexturedRoom& room) {
  tf2_msgs::TFMessage links;
  links.transforms = {
      link("map", "floor", mapToFloor()),
      link("floor", "camera_optical_frame", room.camera.T_optical_surface.inverse()),
      link("floor", "projector_optical_frame", room.projector.T_optical_surface.inverse())};
  return links;
}

/// A tiled floor, and everything that somebody has who photographs it, in one folder for all tests.
struct Site {
  Site() {
    // As the README has it: pictures to show, and each one's photograph under its name.
    const std::string pictures = folder.path("colors");
    runProgram({AFTERGLOW_TEST_COMMAND, "calibrate", "color", "--pictures", pictures, "--width",
                "64", "--height", "40"});
    room.open();
    fs::create_directories(folder.path("photographs"));
    for (const auto& entry : fs::directory_iterator(pictures)) {
      const auto bgr = cv::imread(entry.path().string()).at<cv::Vec3b>(0, 0);
      save("photographs/" + entry.path().filename().string(),
           room.photograph({bgr[2], bgr[1], bgr[0]}));
    }
    save("flat.png", room.photographFlat());
    calib::Calibration calibration;
    calibration.estimate.projector = test::lensOf(room.projector);
    calibration.estimate.T_camera_projector = Rigid<Camera, Projector>(
        room.camera.T_optical_surface * room.projector.T_optical_surface.inverse());
    calibration.camera = calibration.camera_info = test::lensOf(room.camera);
    calib::saveCalibration(folder.path("calibration"), calibration, {}, "2026-11-28T12:00:00Z");
    photographTags();
  }

  void save(const std::string& name, const cv::Mat& image) const {
    cv::imwrite(folder.path(name), image, {cv::IMWRITE_PNG_COMPRESSION, 1});
  }

  /// A printed board on the floor, 0.6 m ahead.
  void photographTags() const {
    runProgram({AFTERGLOW_TEST_COMMAND, "calibrate", "board", "--paper", "A2", "--out",
                folder.path("board")});
    const calib::Board board = calib::loadBoard(folder.path("board/board.yaml"));
    const cv::Mat print = cv::imread(folder.path("board/board.png"), cv::IMREAD_GRAYSCALE);
    const Eigen::Vector2d middle(0.6, 0);
    constexpr int kSide = 3;  // samples of a pixel
    cv::Mat image(room.camera.height, room.camera.width, CV_8U);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        double sum = 0;
        for (int i = 0; i < kSide * kSide; ++i) {
          const auto place = room.camera.placeOf(x + (i % kSide + 0.5) / kSide - 0.5,
                                                 y + (i / kSide + 0.5) / kSide - 0.5);
          const Eigen::Vector2d share = place
                                            ? ((*place - middle).cwiseQuotient(board.size_m)).eval()
                                            : Eigen::Vector2d(9, 9);
          const bool is_print = share.cwiseAbs().maxCoeff() < 0.5;
          sum += is_print ? print.at<std::uint8_t>(static_cast<int>((0.5 - share.y()) * print.rows),
                                                   static_cast<int>((0.5 + share.x()) * print.cols))
                          : 90;
        }
        image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(sum / (kSide * kSide));
      }
    }
    save("tags.png", image);
    std::ofstream layout(folder.path("tags.yaml"));
    layout << "family: " << board.family << "\ntags:\n";
    for (const calib::Tag& tag : board.tags) {
      layout << "  - {id: " << tag.id << ", corners: [";
      for (const Eigen::Vector2d& corner : tag.corners) {
        layout << "[" << (corner + middle).x() << ", " << (corner + middle).y() << "], ";
      }
      layout << "]}\n";
    }
  }

  test::TempFolder folder;
  TexturedRoom room = test::roomWith(test::RoomSurface::Tiles, 0.5);
};

const Site& site() {
  static const Site site;
  return site;
}

class TextureCommand : public test::CalibrateCommand {
 protected:
  TextureCommand() { configure(""); }

  void configure(const std::string& projector_keys) const {
    write("world.yaml",
          "fixed_frame: map\n"
          "projector: {camera_info: projector.yaml, frame: projector_optical_frame, drawing: cpu" +
              projector_keys +
              "}\n"
              "surfaces:\n"
              "  floor: {frame: floor, polygon: [[-1, -2], [3, -2], [3, 2], [-1, 2]]}\n"
              "  moving: {frame: floor, find_in: /points, height: [0, 1]}\n"
              "layers:\n"
              "  - {topic: /area, type: visualization_msgs/Marker, placement: drape, surface: "
              "floor}\n");
  }

  /// The command but for what says where the camera was.
  std::vector<std::string> command(const std::vector<std::string>& more) const {
    std::vector<std::string> all = {"texture",
                                    "--config",
                                    path("world.yaml"),
                                    "--surface",
                                    "floor",
                                    "--calibration",
                                    site().folder.path("calibration"),
                                    "--images",
                                    site().folder.path("photographs"),
                                    "--out",
                                    path("out")};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  /// It replaces the value of an option.
  std::vector<std::string> with(const std::string& option, const std::string& value) const {
    std::vector<std::string> all = command({"--camera-tf", cameraTf()});
    *(std::find(all.begin(), all.end(), option) + 1) = value;
    return all;
  }
  static std::string cameraTf() {
    const Eigen::Isometry3d T = site().room.camera.T_optical_surface.inverse();
    const Eigen::Quaterniond q(T.linear());
    std::ostringstream text;
    text.precision(17);
    text << T.translation().x() << "," << T.translation().y() << "," << T.translation().z() << ","
         << q.x() << "," << q.y() << "," << q.z() << "," << q.w();
    return text.str();
  }
  nlohmann::json found(const std::vector<std::string>& more) const {
    auto arguments = command(more);
    arguments.push_back("--json");
    const ProgramResult result = calibrate(arguments);
    EXPECT_EQ(result.status, 0) << result.output;
    return result.status == 0 ? nlohmann::json::parse(result.output) : nlohmann::json();
  }

  /// The picture that `afterglow render` sends, of one color all over the floor, to a projector
  /// that stands where the room's does.
  render::Image sent(const TexturedRoom& room) const {
    visualization_msgs::Marker area;
    area.header.frame_id = "floor";
    area.type = visualization_msgs::Marker::CUBE;
    area.pose.position.x = 1;
    area.pose.orientation.w = area.color.a = 1;
    area.scale.x = area.scale.y = 3.9;
    area.scale.z = 0.001;
    area.color.r = static_cast<float>(kAsked[0]) / 255;
    area.color.g = static_cast<float>(kAsked[1]) / 255;
    area.color.b = static_cast<float>(kAsked[2]) / 255;
    rosbag::Bag bag(path("area.bag"), rosbag::bagmode::Write);
    bag.write("/tf_static", ros::Time(1000), linksOf(room));
    bag.write("/area", ros::Time(1001), area);
    bag.write("/area", ros::Time(1002), area);
    bag.close();
    const ProgramResult result =
        runProgram({AFTERGLOW_TEST_COMMAND, "render", path("area.bag"), "--config",
                    path("world.yaml"), "--calibration", path("out"), "--out", path("sent.png")});
    EXPECT_EQ(result.status, 0) << result.output;
    cv::Mat rgb;
    cv::cvtColor(cv::imread(path("sent.png")), rgb, cv::COLOR_BGR2RGB);
    return {rgb.cols, rgb.rows, {rgb.data, rgb.data + rgb.total() * 3}};
  }

  /// Where AFTERGLOW_TEXTURE_PICTURES names a folder: what somebody sees.
  static void savePicture(const TexturedRoom& room, const render::Image& image,
                          const std::string& name) {
    const char* const folder = std::getenv("AFTERGLOW_TEXTURE_PICTURES");
    if (folder != nullptr) cv::imwrite(folder + ("/" + name), room.picture(image.rgb, 0.6));
  }
};

TEST_F(TextureCommand, writesWhatHasLightSeenAsItWasAskedForAlsoFromElsewhere) {
  auto arguments = command({"--camera-tf", cameraTf(), "--flat", site().folder.path("flat.png")});
  // Its folder is the calibration's.
  fs::copy(site().folder.path("calibration"), path("out"), fs::copy_options::recursive);
  const ProgramResult said = calibrate(arguments);
  ASSERT_EQ(said.status, 0) << said.output;
  EXPECT_NE(said.output.find("8 mixed colors that were not fitted to"), std::string::npos);
  EXPECT_NE(said.output.find("textures: [floor_texture.yaml]"), std::string::npos) << said.output;
  arguments.push_back("--json");
  const auto json = nlohmann::json::parse(calibrate(arguments).output);
  EXPECT_GT(json["share_known"].get<double>(), 0.9);
  EXPECT_LT(json["check_median"].get<double>(), 2);
  const calib::SurfaceTexture texture = calib::loadTexture(json["file"].get<std::string>());

  TexturedRoom room = site().room;
  const double even_white = json["white"].get<double>() / room.exposure;
  const auto judged = [&](const std::string& name, double& white) {
    const render::Image image = sent(room);
    savePicture(room, image, name + ".png");
    white = test::medianWhite(room, kAsked, image);
    return test::judge(room, texture, white, kAsked, image, even_white);
  };
  double white = 0;
  EXPECT_GT(judged("drawn", white).median(), 10);
  configure(", textures: [floor_texture.yaml]");
  for (const std::string moment : {"there", "moved"}) {
    test::Verdict verdict = judged(moment, white);
    if (moment == "there") {
      EXPECT_NEAR(white, even_white, 0.03 * even_white);
    }
    EXPECT_GT(verdict.reachable, 0.5);
    EXPECT_LT(verdict.median(), 3) << moment;
    EXPECT_LT(verdict.p95(), 6) << moment;
    test::moveProjector(room);
  }
}

TEST_F(TextureCommand, knowsWhereTheCameraWasByTagsAndByTheRunningRobot) {
  const auto by_numbers = found({"--camera-tf", cameraTf()});
  const auto by_tags = found(
      {"--tags", site().folder.path("tags.yaml"), "--photograph", site().folder.path("tags.png")});
  nlohmann::json by_robot;
  {
    const test::TestGraph graph("calibrate_texture_test");
    ros::NodeHandle nh;
    auto publisher = nh.advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
    publisher.publish(linksOf(site().room));
    by_robot = found({"--from-tf"});
    expectRefused(command({"--from-tf", "--camera-frame", "nowhere"}), "nowhere");
    ros::shutdown();
  }
  setenv("ROS_MASTER_URI", "http://localhost:1", 1);
  for (const auto& other : {by_tags, by_robot}) {
    for (const char* key : {"cell_mm", "share_known", "white", "check_median"}) {
      const double expected = by_numbers[key].get<double>();
      EXPECT_NEAR(other[key].get<double>(), expected, 0.02 * expected) << key;
    }
  }
  expectRefused(command({"--from-tf"}), "no ROS master answers at http://localhost:1");
}

TEST_F(TextureCommand, refusesPhotographsThatTellNothing) {
  const std::string photographs = site().folder.path("photographs");
  const auto changed = [&](const std::string& name, const auto& change) {
    fs::remove_all(path("photographs"));
    fs::create_directories(path("photographs"));
    for (const auto& entry : fs::directory_iterator(photographs)) {
      const std::string file = entry.path().filename().string();
      cv::Mat image = cv::imread(entry.path().string());
      if (name.empty() || file.find(name) != std::string::npos) change(image);
      if (!image.empty()) cv::imwrite(path("photographs/" + file), image);
    }
    return with("--images", path("photographs"));
  };
  expectRefused(with("--images", path("nowhere")), "nowhere: cannot be read");
  expectRefused(changed("", [](cv::Mat& image) { image.release(); }),
                "holds no photograph of black");
  expectRefused(changed("_ffffff", [](cv::Mat& image) { image.release(); }),
                "holds no photograph of white");
  expectRefused(changed("_0000ff", [](cv::Mat& image) { image.release(); }),
                "no photograph of #0000ff");
  const auto half = [](cv::Mat& image) { cv::resize(image, image, {}, 0.5, 0.5); };
  expectRefused(changed("_ff0000", half), "is of another size than the photograph of black");
  expectRefused(changed("", half), "is of 240 x 180 pixels, the camera has 480 x 360");
  expectRefused(changed("", [](cv::Mat& image) { image /= 20; }),
                "the photographs are too dark: expose all longer");
  expectRefused(changed("", [](cv::Mat& image) { image.setTo(cv::Scalar::all(40)); }),
                "white is nowhere brighter than black: no projector's light is seen");
  expectRefused(changed("", [](cv::Mat& image) { image *= 3; }), "overexposed");
  auto flat = command({"--camera-tf", cameraTf(), "--flat", path("photographs/black.png")});
  cv::imwrite(path("photographs/black.png"), cv::Mat::zeros(360, 480, CV_8UC3));
  expectRefused(flat, "is not evenly lit, or over- or underexposed");
  EXPECT_FALSE(fs::exists(path("out")));
}

TEST_F(TextureCommand, refusesPlacesWhereNothingIsSeenAndFilesThatCannotBe) {
  expectRefused(with("--camera-tf", "0,0,1.5,0,0,0,1"), "is not where the camera looks");
  expectRefused(with("--camera-tf", "0,0,nan,0,0,0,1"), "--camera-tf");
  expectRefused(with("--camera-tf", "0,0,1.5,0,0,0,2"), "--camera-tf: the quaternion");
  expectRefused(with("--camera-tf", "40,0,1.5,1,0,0,0"), "the projector's light is not on 'floor'");
  expectRefused(with("--surface", "roof"), "world.yaml: has no surface 'roof'");
  expectRefused(with("--surface", "moving"),
                "surface 'moving' is found, or has a relief: a texture needs a plane");
  expectRefused(with("--calibration", path("nowhere")), "nowhere/");
  expectRefused(with("--config", path("nowhere.yaml")), "nowhere.yaml: cannot be read");
  auto fine = command({"--camera-tf", cameraTf(), "--cell-mm", "0.1"});
  expectRefused(fine, "cells of 0.1 mm are more than 4 million");
  write("out", "a file where the folder should be");
  expectRefused(with("--surface", "floor"), "out");
}

TEST_F(TextureCommand, endsWithTwoForWrongUsage) {
  expectWrongUsage({"texture", "--out", "x"});
  expectWrongUsage(command({}));
  expectWrongUsage(command({"--from-tf", "--camera-tf", cameraTf()}));
  expectWrongUsage(command({"--tags", "tags.yaml"}));
  expectWrongUsage(command({"--camera-tf", cameraTf(), "--photograph", "tags.png"}));
  expectWrongUsage(command({"--camera-tf", cameraTf(), "--camera-frame", "camera"}));
  expectWrongUsage(command({"--camera-tf", "1,2,3"}));
  expectWrongUsage(command({"--camera-tf", cameraTf(), "--cell-mm", "0"}));
}

}  // namespace
}  // namespace afterglow::nodes::calibrate_texture_ros_test
