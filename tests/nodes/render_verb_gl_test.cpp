#include <afterglow/ReplayStatus.h>
#include <gtest/gtest.h>
#include <nav_msgs/Path.h>
#include <ros/time.h>
#include <rosbag/bag.h>
#include <sound_play/SoundRequest.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/Marker.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/tools/program.hpp"
#include "render/light_output.hpp"
#include "tests/support/cloud_messages.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/optics.hpp"
#include "tests/support/projected_cloud.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::render_verb_gl_test {
namespace {

const std::string kConfig =
    "fixed_frame: map\n"
    "projector: {camera_info: projector.yaml, frame: projector_optical_frame}\n"
    "layers:\n"
    "  - {topic: /cloud, type: sensor_msgs/PointCloud2, style: points, size: 3}\n";

render::Image readPng(const std::string& path) {
  const cv::Mat bgr = cv::imread(path, cv::IMREAD_COLOR);
  if (bgr.empty()) return {};
  cv::Mat rgb;
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  return {rgb.cols, rgb.rows, std::vector<std::uint8_t>(rgb.data, rgb.data + rgb.total() * 3)};
}

class RenderVerb : public test::GlTest, public testing::WithParamInterface<test::Source> {
 protected:
  void SetUp() override {
    test::GlTest::SetUp();
    setenv("ROS_MASTER_URI", "http://localhost:1", 1);  // nobody is there
    std::ofstream(config_) << kConfig;
    writeBag();
  }

  /// Transforms at 1000 s; the cloud from 1001 s; cleared at 1003 s; the end at 1004 s.
  void writeBag() {
    tf2_msgs::TFMessage transforms, later;
    transforms.transforms = cloud_.transforms();
    rosbag::Bag bag(bag_, rosbag::bagmode::Write);
    bag.write("/tf_static", ros::Time(1000), transforms);
    bag.write("/cloud", ros::Time(1001), test::cloudMessage("base_link", cloud_.points));
    bag.write("/cloud", ros::Time(1003), sensor_msgs::PointCloud2());
    bag.write("/tf", ros::Time(1004), later);
    bag.close();
  }

  ProgramResult render(const std::string& what, const std::string& out,
                       const std::vector<std::string>& more = {}) {
    std::vector<std::string> all = {
        AFTERGLOW_TEST_COMMAND, "render",             what,    "--config", config_,
        "--calibration",        cloud_.calibration(), "--out", out};
    all.insert(all.end(), more.begin(), more.end());
    return runProgram(all);
  }

  const test::ProjectedCloud cloud_{GetParam()};
  test::TempFolder folder_;
  std::string config_ = folder_.path("config.yaml"), bag_ = folder_.path("small.bag"),
              png_ = folder_.path("out.png");
};

TEST_P(RenderVerb, drawsTheLastLitMomentOfABagWithoutAMaster) {
  const ProgramResult result = render(bag_, png_);
  ASSERT_EQ(result.status, 0) << result.output;
  cloud_.expectLit(readPng(png_));
}

TEST_P(RenderVerb, drawsABehaviorOfAStoreAtAMoment) {
  const std::string store = folder_.path("store.db");
  ASSERT_EQ(runProgram({AFTERGLOW_TEST_COMMAND, "import", bag_, "--store", store}).status, 0);
  ProgramResult result = render("1", png_, {"--store", store, "--at", "2.5"});
  ASSERT_EQ(result.status, 0) << result.output;
  cloud_.expectLit(readPng(png_));
  for (const char* dark : {"0.9", "3.1"}) {
    result = render("1", png_, {"--store", store, "--at", dark});
    EXPECT_EQ(result.status, 0) << result.output;
    EXPECT_NE(result.output.find("the picture is dark"), std::string::npos) << result.output;
    EXPECT_EQ(test::litPixels(readPng(png_)), 0);
  }
}

TEST_P(RenderVerb, saysOfALitPictureWhatItDoesNotShow) {
  std::ofstream(config_) << kConfig << "  - {topic: /markers, type: visualization_msgs/Marker}\n"
                         << "  - {topic: /path, type: nav_msgs/Path}\n";
  {
    rosbag::Bag bag(bag_, rosbag::bagmode::Append);
    visualization_msgs::Marker marker;
    marker.header.frame_id = "map";
    marker.type = visualization_msgs::Marker::LINE_STRIP;
    marker.scale.x = 0.01;
    marker.color.a = marker.color.g = 1;
    marker.points.resize(2);
    marker.points[1].x = std::nan("");
    bag.write("/markers", ros::Time(1001), marker);
    marker.points[1].x = 0;
    marker.id = 1;
    marker.color.a = 0;
    bag.write("/markers", ros::Time(1001), marker);
    nav_msgs::Path path;
    path.header.frame_id = "map";
    path.poses.resize(1);
    bag.write("/path", ros::Time(1001), path);
  }
  const ProgramResult result = render(bag_, png_, {"--at", "2"});
  ASSERT_EQ(result.status, 0) << result.output;
  cloud_.expectLit(readPng(png_));
  for (const char* said :
       {"/markers: 1 dropped (a point is not finite or absurdly far)",
        "/markers: 0 of 1 drawable inside the light (1 of alpha 0)",
        "/path: its newest message shows nothing: a path of one pose"}) {
    EXPECT_NE(result.output.find(said), std::string::npos) << result.output;
  }
}

TEST_P(RenderVerb, drawsOneOfSeveralProjectorsAsItIsSent) {
  std::string text = kConfig;
  const std::string one = "projector: {",
                    values = "camera_info: projector.yaml, frame: projector_optical_frame";
  text.replace(text.find(one), text.find("}\n") + 2 - text.find(one),
               "projectors:\n  left: {" + values + "}\n  right: {" + values + ", mirror: both}\n");
  std::ofstream(config_) << text;
  ProgramResult result = render(bag_, png_, {"--projector", "left"});
  ASSERT_EQ(result.status, 0) << result.output;
  const render::Image left = readPng(png_);
  cloud_.expectLit(left);
  ASSERT_EQ(render(bag_, png_, {"--projector", "right"}).status, 0);
  render::Image right = readPng(png_);
  render::LightOutput({{}, 1, render::Mirror::Both}).apply(right);
  EXPECT_EQ(left.rgb, right.rgb);
  result = render(bag_, png_);
  EXPECT_EQ(result.status, 1);
  EXPECT_NE(result.output.find("--projector is needed, one of: left, right"), std::string::npos)
      << result.output;
  result = render(bag_, png_, {"--projector", "up"});
  EXPECT_NE(result.output.find("no projector 'up' in the configuration; known: left, right"),
            std::string::npos)
      << result.output;
}

TEST_P(RenderVerb, drawsAProjectorsShareOfTheLightAsItIsSent) {
  std::string text = kConfig;
  const std::string one = "projector: {",
                    values = "camera_info: projector.yaml, frame: projector_optical_frame";
  text.replace(text.find(one), text.find("}\n") + 2 - text.find(one),
               "projectors:\n  left: {" + values + "}\n  right: {" + values +
                   "}\n  up: {camera_info: projector.yaml, frame: no_such_frame}\n"
                   "blend: true\nsurfaces: {floor: {frame: base_link}}\n");
  std::ofstream(config_) << text;
  const ProgramResult result = render(bag_, png_, {"--projector", "right"});
  ASSERT_EQ(result.status, 0) << result.output;
  const render::Image right = readPng(png_);
  cloud_.expectLit(right);
  EXPECT_EQ(*std::max_element(right.rgb.begin(), right.rgb.end()), 188);  // half of white's light
}

TEST_P(RenderVerb, makesAVideoOfTheWholeBehavior) {
  if (!hasProgram("ffmpeg") || !hasProgram("ffprobe")) GTEST_SKIP() << "ffmpeg is not installed";
  const std::string video = folder_.path("film.mp4");
  const ProgramResult result = render(bag_, video, {"--fps", "5"});
  ASSERT_EQ(result.status, 0) << result.output;
  EXPECT_EQ(runProgram({"ffprobe", "-v", "error", "-count_frames", "-show_entries",
                        "stream=width,height,nb_read_frames", "-of", "csv=p=0", video})
                .output,
            "1280,800,21\n");  // four seconds and the last moment
  const std::string frame = folder_.path("frame.png");
  runProgram({"ffmpeg", "-v", "error", "-ss", "2", "-i", video, "-frames:v", "1", frame});
  EXPECT_GT(test::litPixels(readPng(frame)), 500);
}

TEST_P(RenderVerb, refusesInOneLine) {
  const auto expectRefusal = [this](const ProgramResult& result, const std::string& text) {
    EXPECT_EQ(result.status, 1) << result.output;
    EXPECT_NE(result.output.find(text), std::string::npos) << result.output;
    EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
    EXPECT_FALSE(std::filesystem::exists(png_));
  };
  expectRefusal(render(bag_, png_, {"--at", "9"}), "--at 9.000 is not within the 4.000 s of");
  std::ofstream(config_) << kConfig << "  - {topic: /tf_static, type: nav_msgs/Path}\n";
  std::string text = kConfig;
  text.replace(text.find("sensor_msgs/PointCloud2, style: points, size: 3"), 47,
               "visualization_msgs/Marker");
  std::ofstream(config_) << text;
  expectRefusal(render(bag_, png_), "topic '/cloud' holds sensor_msgs/PointCloud2 (md5 ");
  text = kConfig;
  text.replace(text.find("projector_optical_frame"), 23, "no_such_frame");
  std::ofstream(config_) << text;
  expectRefusal(render(bag_, png_),
                "is lit: projector: no transform from 'no_such_frame' to 'map'");
  std::ofstream(config_) << kConfig << "style: boxes\n";
  expectRefusal(render(bag_, png_), "config.yaml:5: unknown key 'style' in the configuration");
  std::ofstream(config_) << kConfig;
  std::filesystem::resize_file(bag_, 3000);
  expectRefusal(render(bag_, png_), "small.bag");
  expectRefusal(render(folder_.path("none.bag"), png_), "none.bag");
  EXPECT_EQ(render(bag_, folder_.path("out.jpg")).status, 2);
  EXPECT_EQ(render(bag_, png_, {"--fps", "0"}).status, 2);
}

INSTANTIATE_TEST_SUITE_P(On, RenderVerb, test::sources(), test::sourceName);

/// A projector with a fisheye 2 m over the floor, and a green square on the floor before it.
class ObservedBehavior : public test::GlTest {
 protected:
  void SetUp() override {
    test::GlTest::SetUp();
    setenv("ROS_MASTER_URI", "http://localhost:1", 1);
    write(lens_,
          "{image_width: 800, image_height: 600, camera_name: p,\n"
          " camera_matrix: {rows: 3, cols: 3, data: [500, 0, 400, 0, 500, 300, 0, 0, 1]},\n"
          " distortion_model: equidistant,\n"
          " distortion_coefficients: {rows: 1, cols: 4, data: [0.02, -0.01, 0, 0]}}\n");
    write(
        config_,
        "fixed_frame: map\n"
        "projector: {camera_info: lens.yaml, frame: projector, drawing: opengl}\n"
        "surfaces: {floor: {frame: map, polygon: [[-3, -3], [3, -3], [3, 3], [-3, 3]]}}\n"
        "layers:\n"
        "  - {topic: /mark, type: visualization_msgs/Marker, placement: drape, surface: floor}\n");
    write(urdf_,
          "<robot name='shade'><link name='shade'><visual><geometry><box size='0.3 0.3 0.02'/>"
          "</geometry></visual></link></robot>\n");
    writeBag();
  }

  static void write(const std::string& path, const std::string& text) {
    std::ofstream(path) << text;
  }

  void writeBag() {
    tf2_msgs::TFMessage transforms, later;
    const auto add = [&](const std::string& frame, const Eigen::Isometry3d& T_map_frame) {
      transforms.transforms.emplace_back();
      transforms.transforms.back().header.frame_id = "map";
      transforms.transforms.back().child_frame_id = frame;
      transforms.transforms.back().transform = toTransform(T_map_frame);
    };
    add("projector", test::lookAt<Projector>({0, 0, 2}, {1, 0, 0}).matrix());
    add("shade", Eigen::Isometry3d(Eigen::Translation3d(p_mark_ / 2 + Eigen::Vector3d(0, 0, 1))));
    visualization_msgs::Marker mark;
    mark.header.frame_id = "map";
    mark.type = visualization_msgs::Marker::CUBE;
    mark.pose.position.x = p_mark_.x();
    mark.pose.position.y = p_mark_.y();
    mark.pose.position.z = 0.7;
    mark.pose.orientation.w = 1;
    mark.scale.x = mark.scale.y = mark.scale.z = 0.2;
    mark.color.g = mark.color.a = 1;
    rosbag::Bag bag(bag_, rosbag::bagmode::Write);
    bag.write("/tf_static", ros::Time(1000), transforms);
    bag.write("/mark", ros::Time(1000.5), mark);
    bag.write("/tf", ros::Time(1001), later);
    bag.close();
  }

  ProgramResult observe(const std::string& out, const std::vector<std::string>& more = {}) {
    std::vector<std::string> all = {AFTERGLOW_TEST_COMMAND,
                                    "render",
                                    bag_,
                                    "--config",
                                    config_,
                                    "--out",
                                    out,
                                    "--view",
                                    "observer"};
    all.insert(all.end(), more.begin(), more.end());
    return runProgram(all);
  }
  ProgramResult observeFromTheSide(const std::vector<std::string>& more = {}) {
    std::vector<std::string> all = {"--eye", "-1,-2,1.5", "--look-at=0.8,0.1,0"};
    all.insert(all.end(), more.begin(), more.end());
    return observe(png_, all);
  }

  /// Where a place of the room is in that picture.
  static Eigen::Vector2d pixel(const Eigen::Vector3d& p_world) {
    const auto T_world_eye = test::lookAt<Observer>({-1, -2, 1.5}, {0.8, 0.1, 0});
    const Eigen::Vector3d p = T_world_eye.inverse() * p_world;
    return Eigen::Vector2d(639.5, 359.5) + 360 / std::tan(0.375) * p.hnormalized();
  }

  struct Green {
    int pixels = 0;
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  };
  static Green green(const render::Image& image) {
    Green green;
    for (int v = 0; v < image.height; ++v) {
      for (int u = 0; u < image.width; ++u) {
        const auto* rgb = &image.rgb[3 * static_cast<std::size_t>(v * image.width + u)];
        if (rgb[1] < rgb[0] + 170) continue;  // a halo is darker
        ++green.pixels;
        green.middle += Eigen::Vector2d(u, v);
      }
    }
    green.middle /= std::max(green.pixels, 1);
    return green;
  }

  const Eigen::Vector3d p_mark_{0.8, 0.1, 0};
  test::TempFolder folder_;
  const std::string bag_ = folder_.path("small.bag"), config_ = folder_.path("config.yaml"),
                    lens_ = folder_.path("lens.yaml"), urdf_ = folder_.path("shade.urdf"),
                    png_ = folder_.path("out.png");
};

TEST_F(ObservedBehavior, lightFallsOnTheFloorUnderTheMarker) {
  const ProgramResult result = observeFromTheSide();
  ASSERT_EQ(result.status, 0) << result.output;
  const render::Image image = readPng(png_);
  ASSERT_EQ(image.width, 1280);
  const Green found = green(image);
  EXPECT_LT((found.middle - pixel(p_mark_)).norm(), 1.5);
  std::vector<cv::Point2f> corners;
  for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
    const Eigen::Vector2d corner = pixel(p_mark_ + 0.1 * Eigen::Vector3d(x, y, 0));
    corners.emplace_back(static_cast<float>(corner.x()), static_cast<float>(corner.y()));
  }
  EXPECT_NEAR(found.pixels / cv::contourArea(corners), 1, 0.05);
}

TEST_F(ObservedBehavior, whatTheRobotIsInTheWayOfFallsOnTheRobot) {
  const ProgramResult result = observeFromTheSide({"--urdf", urdf_});
  ASSERT_EQ(result.status, 0) << result.output;
  const Green found = green(readPng(png_));
  EXPECT_GT(found.pixels, 200);
  EXPECT_LT((found.middle - pixel(p_mark_ / 2 + Eigen::Vector3d(0, 0, 1.01))).norm(), 20);
}

TEST_F(ObservedBehavior, standsInARoomWithPlaces) {
  write(folder_.path("room.yaml"),
        "{fixed_frame: map, eye: [-1, -2, 1.5], target: [0.8, 0.1, 0], vertical_fov: 45,\n"
        " size: [320, 180], others: {top: {eye: [0.7, 0, 3], target: [0.8, 0.1, 0],"
        " vertical_fov: 60}},\n"
        " floor: {center: [0, 0], size: [6, 6], color: \"#cccccc\", tile: 0.5,"
        " joint_color: \"#999999\"}, walls: []}\n");
  const std::string room = folder_.path("room.yaml");
  ASSERT_EQ(observe(png_, {"--room", room}).status, 0);
  const Green aside = green(readPng(png_));
  EXPECT_EQ(readPng(png_).width, 320);
  ASSERT_EQ(observe(png_, {"--room", room, "--place", "top"}).status, 0);
  const Green above = green(readPng(png_));
  EXPECT_GT(aside.pixels, 50);
  EXPECT_LT((above.middle - Eigen::Vector2d(159.5, 89.5)).norm(), 2);
  EXPECT_NE(observe(png_, {"--room", room, "--place", "roof"})
                .output.find("room.yaml: has no place 'roof' to look from; it has: top"),
            std::string::npos);
  if (!hasProgram("ffmpeg") || !hasProgram("ffprobe")) return;
  const std::string video = folder_.path("film.mp4");
  ASSERT_EQ(observe(video, {"--room", room, "--fps", "2"}).status, 0);
  EXPECT_EQ(runProgram({"ffprobe", "-v", "error", "-count_frames", "-show_entries",
                        "stream=width,height,nb_read_frames", "-of", "csv=p=0", video})
                .output,
            "320,180,3\n");
}

TEST_F(ObservedBehavior, standsInARoomAroundItWhereNobodyDescribesOne) {
  const ProgramResult result = observe(png_);
  ASSERT_EQ(result.status, 0) << result.output;
  const render::Image image = readPng(png_);
  EXPECT_EQ(image.height, 648);
  EXPECT_GT(green(image).pixels, 200);
}

TEST_F(ObservedBehavior, becomesAFilmWithCaptionsAndSound) {
  if (!hasProgram("ffmpeg") || !hasProgram("ffprobe")) GTEST_SKIP() << "ffmpeg is not installed";
  const auto probe = [](const std::string& path, const std::string& entries) {
    return runProgram({"ffprobe", "-v", "error", "-count_frames", "-show_entries", entries, "-of",
                       "csv=p=0", path})
        .output;
  };
  rosbag::Bag bag(bag_, rosbag::bagmode::Append);
  sound_play::SoundRequest request;
  request.sound = sound_play::SoundRequest::SAY;
  request.command = sound_play::SoundRequest::PLAY_ONCE;
  request.volume = 1;
  request.arg = "Here.";
  bag.write("/robotsound", ros::Time(1000.2), request);
  bag.close();
  const std::string path = folder_.path("film.mp4");
  const std::vector<std::string> film = {AFTERGLOW_TEST_COMMAND, "render",  bag_,   "--film",
                                         "--config",             config_,   "--fps", "5",
                                         "--out",                path};
  ProgramResult result = runProgram(film);
  ASSERT_EQ(result.status, 0) << result.output;
  EXPECT_EQ(result.output.rfind(path + ": 0.", 0), 0u) << result.output;
  EXPECT_EQ(probe(path, "stream=codec_name,width,height"), "h264,1280,720\naac\n");
  const std::string frame = folder_.path("frame.png");
  runProgram({"ffmpeg", "-v", "error", "-ss", "0.8", "-i", path, "-frames:v", "1", frame});
  EXPECT_GT(green(readPng(frame)).pixels, 400) << "in the room, and in the projector's image";
  std::vector<std::string> beside = film;
  beside.insert(beside.end(), {"--beside", bag_});
  result = runProgram(beside);
  ASSERT_EQ(result.status, 0) << result.output;
  EXPECT_EQ(probe(path, "stream=codec_name,width,height"), "h264,1280,720\naac\n");
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path("."))) {
    EXPECT_EQ(entry.path().string().find("parts"), std::string::npos) << entry.path();
  }
  beside.insert(beside.end(), {"--view", "projector"});
  EXPECT_EQ(runProgram(beside).status, 2);
}

TEST_F(ObservedBehavior, showsAReplayInStepWithWhatItReplays) {
  if (!hasProgram("ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
  const std::string replay = folder_.path("replay.bag"), path = folder_.path("film.mp4");
  {
    rosbag::Bag bag(replay, rosbag::bagmode::Write);
    const auto tell = [&](double seconds, double position) {
      afterglow::ReplayStatus status;
      status.state = afterglow::ReplayStatus::PLAYING;
      status.behavior_id = 1;
      status.behavior_name = "small";
      status.position = position;
      bag.write("/player_node/status", ros::Time(2000 + seconds), status);
    };
    tell(0, 0);
    tell(2, 0);  // it waited
    tell(3, 1);
    bag.close();
  }
  const ProgramResult result =
      runProgram({AFTERGLOW_TEST_COMMAND, "render", replay, "--film", "--beside", bag_, "--config",
                  config_, "--fps", "5", "--at-most", "1.5", "--out", path});
  ASSERT_EQ(result.status, 0) << result.output;
  const auto lit = [&](const std::string& seconds) {
    const std::string frame = folder_.path("frame.png");
    runProgram(
        {"ffmpeg", "-v", "error", "-y", "-ss", seconds, "-i", path, "-frames:v", "1", frame});
    return green(readPng(frame));
  };
  EXPECT_LT(lit("0.8").pixels, 50) << "1.6 s, where the behavior was at its beginning";
  EXPECT_GT(lit("1.4").pixels, 100);
  EXPECT_LT(lit("1.4").middle.x(), 640) << "then is on the left";
}

TEST_F(ObservedBehavior, refusesInOneLine) {
  const auto expectRefusal = [this](const ProgramResult& result, const std::string& text) {
    EXPECT_EQ(result.status, 1) << result.output;
    EXPECT_NE(result.output.find(text), std::string::npos) << result.output;
    EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
    EXPECT_FALSE(std::filesystem::exists(png_));
  };
  expectRefusal(observe(png_, {"--eye", "1,2", "--look-at", "0,0,0"}),
                "--eye should be x,y,z in meters, not '1,2'");
  expectRefusal(observe(png_, {"--eye", "1,2,3", "--look-at", "0,0,zero"}),
                "--look-at should be x,y,z in meters, not '0,0,zero'");
  expectRefusal(observe(png_, {"--eye", "1,2,3", "--look-at", "1,2,0"}), "straight above or below");
  expectRefusal(observeFromTheSide({"--urdf", folder_.path("none.urdf")}),
                "none.urdf: cannot be opened");
  expectRefusal(observe(png_, {"--room", folder_.path("none.yaml")}), "none.yaml");
  EXPECT_EQ(observe(png_, {"--eye", "1,2,3"}).status, 2);
  EXPECT_EQ(observeFromTheSide({"--place", "top"}).status, 2);
  EXPECT_EQ(runProgram({AFTERGLOW_TEST_COMMAND, "render", bag_, "--config", config_, "--out", png_,
                        "--urdf", urdf_})
                .status,
            2);
}

}  // namespace
}  // namespace afterglow::nodes::render_verb_gl_test
