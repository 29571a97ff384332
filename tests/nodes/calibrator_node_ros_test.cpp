#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sound_play/SoundRequest.h>
#include <std_msgs/String.h>
#include <std_srvs/Trigger.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "calib/camera_info_file.hpp"
#include "calib/report/calibration_files.hpp"
#include "calib/targets/target_files.hpp"
#include "nodes/projector/projector_messages.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/synthetic_rig.hpp"

namespace afterglow::nodes {
namespace {

using test::eventually;

const std::string kProgram = AFTERGLOW_TEST_CALIBRATOR_NODE;
constexpr int kViews = 5;
constexpr int kLag = 2;  // frames until the camera shows what is projected
constexpr std::size_t kSpare = 6;

/// Camera, projector and the person with the board, who moves on after each view taken or
/// discarded.
class Room {
 public:
  Room(const test::SyntheticRig& rig, const std::string& node)
      : rig_(rig),
        photographer_(rig),
        poses_(test::boardPoses(rig, kViews + static_cast<int>(kSpare), 5)) {
    image_publisher_ = nh_.advertise<sensor_msgs::Image>("/room/image_raw", 2);
    info_publisher_ = nh_.advertise<sensor_msgs::CameraInfo>("/room/camera_info", 1, true);
    sensor_msgs::CameraInfo info = toCameraInfo(rig.camera);
    info_publisher_.publish(info);
    pattern_ = nh_.subscribe<sensor_msgs::Image>("/" + node + "/pattern", 4,
                                                 [this](const sensor_msgs::ImageConstPtr& message) {
                                                   const std::lock_guard<std::mutex> lock(mutex_);
                                                   projected_ = message;
                                                 });
    status_ = nh_.subscribe<std_msgs::String>(
        "/" + node + "/status", 20, [this](const std_msgs::StringConstPtr& message) {
          const std::lock_guard<std::mutex> lock(mutex_);
          latest_status_ = nlohmann::json::parse(message->data);
        });
    guidance_ = nh_.subscribe<std_msgs::String>("/" + node + "/guidance", 100,
                                                [this](const std_msgs::StringConstPtr& message) {
                                                  const std::lock_guard<std::mutex> lock(mutex_);
                                                  said_ += message->data + "\n";
                                                });
    sound_ = nh_.subscribe<sound_play::SoundRequest>(
        "/robotsound", 100, [this](const sound_play::SoundRequestConstPtr& message) {
          const std::lock_guard<std::mutex> lock(mutex_);
          spoken_ += message->arg + "\n";
        });
    camera_ = std::thread([this] { film(); });
  }
  ~Room() {
    is_over_ = true;
    camera_.join();
  }

  nlohmann::json status() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return latest_status_;
  }
  std::string said() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return said_;
  }
  std::string spoken() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return spoken_;
  }
  bool isBlack() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return projected_ && std::count(projected_->data.begin(), projected_->data.end(), 0) ==
                             static_cast<std::ptrdiff_t>(projected_->data.size());
  }
  bool isPhase(const std::string& phase) {
    return eventually([&] { return status().value("phase", "") == phase; },
                      std::chrono::seconds(60));
  }
  void setEncoding(const std::string& encoding) {
    const std::lock_guard<std::mutex> lock(mutex_);
    encoding_ = encoding;
  }
  void stopCamera() { is_silent_ = true; }
  /// The person stays where they are.
  void holdStill() { is_held_ = true; }
  bool hasViews(int count) {
    return eventually([&] { return status().value("views", -1) == count; });
  }

 private:
  using Shown = std::pair<std::size_t, std::uint8_t>;  ///< pose, grey level of the first tag

  /// What is in front of the camera now. The pattern is told from grey by a pixel of its own.
  Shown scene() {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::size_t moved = latest_status_.value("views", std::size_t{0}) +
                              latest_status_.value("discarded", std::size_t{0});
    const std::size_t pose = is_held_ ? 0 : std::min(moved, poses_.size() - 1);
    if (!projected_) return {pose, 0};
    const auto [low, high] = std::minmax_element(projected_->data.begin(), projected_->data.end());
    return {pose, *low == *high ? *high : std::uint8_t{255}};
  }

  const calib::Picture& photograph(const Shown& shown) {
    const auto found = album_.find(shown);
    if (found != album_.end()) return found->second;
    const calib::Picture light =
        shown.second == 255
            ? test::patternPicture(rig_.pattern)
            : test::greyPicture(rig_.pattern.width, rig_.pattern.height, shown.second);
    const auto seed = static_cast<std::uint32_t>(7 * shown.first + shown.second);
    return album_[shown] = photographer_.photograph(poses_[shown.first], light, seed);
  }

  void film() {
    std::vector<Shown> on_the_way(kLag, {0, 0});
    ros::Time stamp = ros::Time::now();
    while (!is_over_) {
      on_the_way.push_back(scene());
      // The board is where it is now, the light is that of two frames ago.
      const Shown seen = {on_the_way.back().first, on_the_way.front().second};
      on_the_way.erase(on_the_way.begin());
      stamp += ros::Duration(0.1);
      if (!is_silent_) publish(photograph(seen), stamp);
      std::this_thread::sleep_for(std::chrono::milliseconds(25));
    }
  }

  void publish(const calib::Picture& picture, ros::Time stamp) {
    sensor_msgs::Image message;
    message.header.stamp = stamp;
    message.header.frame_id = "room_camera";
    message.width = message.step = static_cast<std::uint32_t>(picture.width);
    message.height = static_cast<std::uint32_t>(picture.height);
    message.data = picture.pixels;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      message.encoding = encoding_;
    }
    image_publisher_.publish(message);
  }

  const test::SyntheticRig rig_;
  test::Photographer photographer_;
  const std::vector<test::BoardPose> poses_;
  std::map<Shown, calib::Picture> album_;
  std::mutex mutex_;
  sensor_msgs::ImageConstPtr projected_;
  nlohmann::json latest_status_ = nlohmann::json::object();
  std::string said_, spoken_, encoding_ = "mono8";
  std::atomic<bool> is_over_{false}, is_silent_{false}, is_held_{false};
  ros::NodeHandle nh_;
  ros::Publisher image_publisher_, info_publisher_;
  ros::Subscriber pattern_, status_, guidance_, sound_;
  std::thread camera_;
};

class CalibratorNodeTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    master_ = std::make_unique<test::RosMaster>();
    int argc = 0;
    ros::init(argc, nullptr, "calibrator_node_ros_test", ros::init_options::NoSigintHandler);
    nh_ = std::make_unique<ros::NodeHandle>();
    spinner_ = std::make_unique<ros::AsyncSpinner>(1);
    spinner_->start();
  }
  static void TearDownTestSuite() {
    spinner_.reset();
    nh_.reset();
    ros::shutdown();
    master_.reset();
  }
  void SetUp() override {
    calib::writeBoard(folder_.path("targets"), rig_.board);
    calib::writePattern(folder_.path("targets"), rig_.pattern);
  }

  std::vector<std::string> command(const std::string& name) const {
    return {kProgram,
            "__name:=" + name,
            "_board_file:=" + folder_.path("targets/board.yaml"),
            "_pattern_file:=" + folder_.path("targets/pattern.yaml"),
            "_out:=" + folder_.path("out"),
            "_image_topic:=/room/image_raw",
            "_window:=false",
            "_views:=" + std::to_string(kViews),
            "_coverage:=0.2",
            "_still_seconds:=0.3",
            "_settle_frames:=1",
            "_publish_transform:=true"};
  }
  static std_srvs::Trigger call(const std::string& service) {
    std_srvs::Trigger trigger;
    if (!ros::service::waitForService(service, ros::Duration(20)) ||
        !ros::service::call(service, trigger)) {
      throw std::runtime_error("no answer from " + service);  // the rest would wait in vain
    }
    return trigger;
  }

  static inline std::unique_ptr<test::RosMaster> master_;
  static inline std::unique_ptr<ros::NodeHandle> nh_;
  static inline std::unique_ptr<ros::AsyncSpinner> spinner_;
  const test::SyntheticRig rig_ = test::makeRig(test::RigKind::Standard, 3, 512);
  test::TempFolder folder_;
};

TEST_F(CalibratorNodeTest, calibratesAProjectorThroughALaggingCamera) {
  Room room(rig_, "guided");
  std::mutex mutex;
  std::optional<geometry_msgs::TransformStamped> transform;
  std::optional<sensor_msgs::CameraInfo> info;
  const auto transforms = nh_->subscribe<tf2_msgs::TFMessage>(
      "/tf_static", 1, [&](const tf2_msgs::TFMessageConstPtr& message) {
        const std::lock_guard<std::mutex> lock(mutex);
        transform = message->transforms.front();
      });
  const auto infos = nh_->subscribe<sensor_msgs::CameraInfo>(
      "/guided/camera_info", 1, [&](const sensor_msgs::CameraInfoConstPtr& message) {
        const std::lock_guard<std::mutex> lock(mutex);
        info = *message;
      });
  test::NodeProcess node(command("guided"));
  ASSERT_TRUE(room.isPhase("done")) << room.status() << "\n" << room.said() << node.log();

  const auto estimate = calib::loadCalibration(folder_.path("out"));
  // Five views by a camera of a sixth of the usual pixels.
  EXPECT_LT(test::errorP95_mm(rig_, estimate), 0.5);
  EXPECT_LT(room.status().at("held_out_mm"), 1.0);
  EXPECT_LT(room.status().at("check_mm"), 1.0);
  for (const char* file :
       {"views/view_00.png", "views/view_00_plain.png", "views/view_04.png", "report.html",
        "calibration.yaml", "T_camera_projector.yaml", "verification.yaml", "check/view_00.png"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_.path("out/") + file)) << file;
  }
  EXPECT_EQ(calib::loadCameraInfo(folder_.path("out/camera.yaml")).lens.K, rig_.camera.K);
  EXPECT_NE(room.said().find("view taken: 5 of 5 views, coverage "), std::string::npos);
  EXPECT_NE(room.spoken().find("checked: the light is "), std::string::npos) << room.spoken();
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return transform && info;
  }));
  const std::lock_guard<std::mutex> lock(mutex);
  ASSERT_TRUE(transform && info);
  EXPECT_EQ(transform->header.frame_id, "room_camera");
  EXPECT_EQ(transform->child_frame_id, "projector_optical_frame");
  EXPECT_NEAR(transform->transform.translation.x,
              estimate.T_camera_projector.matrix().translation().x(), 1e-9);
  EXPECT_EQ(info->K[5], estimate.projector.K(1, 2));
  node.interrupt();
  EXPECT_EQ(node.exitStatus(), 0);
  EXPECT_TRUE(eventually([&] { return room.isBlack(); }));
}

TEST_F(CalibratorNodeTest, refusesTooFewViewsAndGoesOn) {
  Room room(rig_, "few");
  room.holdStill();
  test::NodeProcess node(command("few"));
  ASSERT_TRUE(room.hasViews(1)) << room.said() << node.log();
  EXPECT_TRUE(call("/few/discard_last").response.success);
  EXPECT_TRUE(room.hasViews(0));
  ASSERT_TRUE(room.hasViews(1)) << room.said();  // nothing is like it any more
  EXPECT_TRUE(call("/few/take").response.success);
  ASSERT_TRUE(room.hasViews(2)) << room.said();
  EXPECT_TRUE(call("/few/solve").response.success);
  EXPECT_TRUE(eventually([&] {
    return room.said().find("cannot calibrate yet: ") != std::string::npos;
  })) << room.said()
      << node.log();
  EXPECT_TRUE(room.isPhase("collecting"));
  EXPECT_TRUE(call("/few/stop").response.success);
  EXPECT_FALSE(call("/few/stop").response.success);
  EXPECT_FALSE(call("/few/take").response.success);
  EXPECT_TRUE(eventually([&] { return room.isBlack(); }));
  EXPECT_TRUE(call("/few/start").response.success);
  EXPECT_TRUE(room.hasViews(0));
  EXPECT_FALSE(std::filesystem::exists(folder_.path("out/projector.yaml")));
}

TEST_F(CalibratorNodeTest, saysWhatIsWrongWithTheCamera) {
  Room room(rig_, "wrong");
  room.setEncoding("mono16");
  test::NodeProcess node(command("wrong"));
  const auto isProblem = [&](const std::string& text) {
    return eventually(
        [&] { return room.status().value("problem", "").find(text) != std::string::npos; });
  };
  EXPECT_TRUE(isProblem("/room/image_raw: image encoding 'mono16' has 16 bits"));
  room.setEncoding("mono8");
  ASSERT_TRUE(room.isPhase("collecting")) << node.log();
  EXPECT_TRUE(eventually([&] { return room.status().value("problem", "?").empty(); }));
  room.stopCamera();
  EXPECT_TRUE(isProblem("the camera has stopped: nothing on /room/image_raw for 3 s"));
  EXPECT_NE(room.said().find("the camera has stopped"), std::string::npos);
  node.interrupt();
  EXPECT_EQ(node.exitStatus(), 0);
}

TEST_F(CalibratorNodeTest, namesTheParameterThatIsWrong) {
  const auto failsWith = [&](const std::string& argument, const std::string& text) {
    auto arguments = command("refused");
    arguments.push_back(argument);
    test::NodeProcess node(arguments);
    EXPECT_EQ(node.exitStatus(), 1);
    EXPECT_NE(node.log().find(text), std::string::npos) << node.log();
  };
  failsWith("_views:=0", "parameter ~views should be from 3 to 1000");
  failsWith("_board_file:=/no/such/board.yaml", "/no/such/board.yaml");
  failsWith("_coverage:=lots", "parameter ~coverage has a value of the wrong type");
}

}  // namespace
}  // namespace afterglow::nodes
