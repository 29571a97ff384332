// `afterglow calibrate latency` as a user meets it, with a projector and a camera that are a
// thread.
#include <ros/ros.h>
#include <sensor_msgs/Image.h>

#include <atomic>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "nodes/projector/projector_config.hpp"
#include "tests/support/calibrate_command.hpp"
#include "tests/support/ros_graph.hpp"

namespace afterglow::nodes::calibrate_latency_ros_test {
namespace {

using std::chrono::duration;
using Clock = std::chrono::system_clock;
using Seconds = duration<double>;

constexpr double kDelay_s = 0.06, kExposure_s = 0.01, kTransport_s = 0.015, kHz = 30;

/// Shows /projector/pattern kDelay_s late, and photographs it.
class LateRoom {
 public:
  LateRoom() {
    images_ = nh_.advertise<sensor_msgs::Image>("/camera/image_raw", 2);
    pattern_ = nh_.subscribe<sensor_msgs::Image>(
        "/projector/pattern", 4, [this](const sensor_msgs::ImageConstPtr& message) {
          const std::lock_guard<std::mutex> lock(mutex_);
          const double shown = message->header.stamp.toSec();
          changes_.emplace_back(shown + kDelay_s, message->data[message->data.size() / 2] > 0);
        });
    camera_ = std::thread([this] { film(); });
  }
  ~LateRoom() {
    is_over_ = true;
    camera_.join();
  }

 private:
  /// The share of the time from `begin` on that is lit.
  double lit(double begin) {
    const std::lock_guard<std::mutex> lock(mutex_);
    int lit = 0;
    for (int i = 0; i < 20; ++i) {
      const double moment = begin + kExposure_s * (i + 0.5) / 20;
      bool is_lit = false;
      for (const auto& [at, level] : changes_) is_lit = at <= moment ? level : is_lit;
      lit += is_lit ? 1 : 0;
    }
    while (changes_.size() > 8) changes_.pop_front();
    return lit / 20.0;
  }

  void film() {
    sensor_msgs::Image message;
    message.encoding = "mono8";
    message.width = message.step = 64;
    message.height = 48;
    const auto start = Clock::now();
    for (int i = 0; !is_over_; ++i) {
      const auto begin =
          start + std::chrono::duration_cast<Clock::duration>(Seconds(i * 1.001 / kHz));
      std::this_thread::sleep_until(
          begin + std::chrono::duration_cast<Clock::duration>(Seconds(kExposure_s + kTransport_s)));
      const double stamp = Seconds(begin.time_since_epoch()).count();
      // sRGB's curve, near enough between these levels; a pixel that counts: no image is the last.
      const double light = 0.05 + 0.3 * lit(stamp);
      message.data.assign(64 * 48, static_cast<std::uint8_t>(255 * std::pow(light, 1 / 2.2)));
      message.data[0] = static_cast<std::uint8_t>(i);
      message.header.stamp.fromSec(stamp);
      images_.publish(message);
    }
  }

  std::mutex mutex_;
  std::deque<std::pair<double, bool>> changes_;  ///< moments of light, s
  std::atomic<bool> is_over_{false};
  ros::NodeHandle nh_;
  ros::Publisher images_;
  ros::Subscriber pattern_;
  std::thread camera_;
};

class LatencyCommand : public test::RosGraph<test::CalibrateCommand> {
 protected:
  void SetUp() override {
    write("lens.yaml",
          "image_width: 640\nimage_height: 400\ncamera_name: projector\n"
          "camera_matrix: {rows: 3, cols: 3, data: [640, 0, 320, 0, 640, 200, 0, 0, 1]}\n"
          "distortion_model: plumb_bob\n"
          "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n"
          "rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n"
          "projection_matrix: {rows: 3, cols: 4, data: [640, 0, 320, 0, 0, 640, 200, 0, 0, 0, 1, "
          "0]}\n");
    write("world.yaml",
          "fixed_frame: map\nprojector: {camera_info: lens.yaml, frame: projector}\n"
          "layers:\n  - {topic: /green, type: sensor_msgs/PointCloud2}\n");
  }
  std::int64_t latencyNs() const {
    return loadProjectorConfig(path("world.yaml"), "").projectors.at(0).latency_ns;
  }
};

TEST_F(LatencyCommand, writesTheDelayIntoTheConfiguration) {
  const LateRoom room;
  const ProgramResult result =
      calibrate({"latency", "--config", path("world.yaml"), "--stamps", "start", "--json"});
  ASSERT_EQ(result.status, 0) << result.output;
  const auto json = nlohmann::json::parse(result.output.substr(result.output.find('{')));
  // The thread that is the room is as late as the machine is busy.
  EXPECT_NEAR(json["latency_ms"].get<double>(), 1000 * kDelay_s, 8) << result.output;
  EXPECT_NEAR(json["exposure_ms"].get<double>(), 1000 * kExposure_s, 5) << result.output;
  EXPECT_GE(json["changes"].get<int>(), 80);
  EXPECT_NEAR(static_cast<double>(latencyNs()), 1e6 * json["latency_ms"].get<double>(), 6e4);
}

TEST_F(LatencyCommand, refusesWithAReasonAndWritesNothing) {
  expectRefused({"latency", "--config", path("world.yaml"), "--image", "/no/camera"},
                "no image on /no/camera: is the camera running, and is that its topic?");
  expectRefused({"latency", "--config", path("world.yaml"), "--projector", "left"},
                "has no projector 'left'");
  expectRefused({"latency", "--config", path("world.yaml"), "--led", path("none/led")},
                "none/led: cannot be opened: No such file or directory");
  expectWrongUsage({"latency", "--config", path("world.yaml"), "--stamps", "sometimes"});
  expectWrongUsage({"latency"});
  EXPECT_EQ(latencyNs(), 0);
}

}  // namespace
}  // namespace afterglow::nodes::calibrate_latency_ros_test
