#include <gtest/gtest.h>
#include <ros/time.h>
#include <rosbag/bag.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/Marker.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "nodes/tools/program.hpp"
#include "tests/support/cloud_messages.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/projected_cloud.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes {
namespace {

const std::string kConfig =
    "fixed_frame: map\n"
    "projector: {camera_info: viewsonic_pa503w_camera_info.yaml,"
    " frame: projector_optical_frame}\n"
    "layers:\n"
    "  - {topic: /cloud, type: sensor_msgs/PointCloud2, style: points, size: 3}\n";

render::Image readPng(const std::string& path) {
  const cv::Mat bgr = cv::imread(path, cv::IMREAD_COLOR);
  if (bgr.empty()) return {};
  cv::Mat rgb;
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  return {rgb.cols, rgb.rows, std::vector<std::uint8_t>(rgb.data, rgb.data + rgb.total() * 3)};
}

class RenderVerb : public test::GlTest {
 protected:
  void SetUp() override {
    test::GlTest::SetUp();
    if (!test::hasSharedData()) GTEST_SKIP() << "no " << test::kSharedData;
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
        AFTERGLOW_TEST_COMMAND, "render",          what,    "--config", config_,
        "--calibration",        test::kSharedData, "--out", out};
    all.insert(all.end(), more.begin(), more.end());
    return runProgram(all);
  }

  test::ProjectedCloud cloud_;
  test::TempFolder folder_;
  std::string config_ = folder_.path("config.yaml"), bag_ = folder_.path("small.bag"),
              png_ = folder_.path("out.png");
};

TEST_F(RenderVerb, drawsTheLastLitMomentOfABagWithoutAMaster) {
  const ProgramResult result = render(bag_, png_);
  ASSERT_EQ(result.status, 0) << result.output;
  cloud_.expectLit(readPng(png_));
}

TEST_F(RenderVerb, drawsABehaviorOfAStoreAtAMoment) {
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

TEST_F(RenderVerb, makesAVideoOfTheWholeBehavior) {
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

TEST_F(RenderVerb, refusesInOneLine) {
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

}  // namespace
}  // namespace afterglow::nodes
