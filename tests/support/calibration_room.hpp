/// \file
/// Everything a live calibration needs round it, simulated: calibrator_node's ~pattern is
/// projected onto a board and photographed, and the photographs are published as a camera's.
#pragma once

#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sound_play/SoundRequest.h>
#include <std_msgs/String.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "nodes/conversion/camera_messages.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/synthetic_rig.hpp"

namespace afterglow::test {

/// Camera, projector and the person with the board, who moves on after each view taken or
/// discarded.
class CalibrationRoom {
 public:
  CalibrationRoom(const SyntheticRig& rig, const std::string& node)
      : rig_(rig), photographer_(rig), poses_(boardPoses(rig, kPoses, 5)) {
    image_publisher_ = nh_.advertise<sensor_msgs::Image>("/room/image_raw", 2);
    info_publisher_ = nh_.advertise<sensor_msgs::CameraInfo>("/room/camera_info", 1, true);
    sensor_msgs::CameraInfo info = nodes::toCameraInfo(rig.camera);
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
  ~CalibrationRoom() {
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
                      std::chrono::seconds(120));
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
  static constexpr int kPoses = 11;                    // more than any test has views and discards
  static constexpr int kLag_frames = 2;                // until the camera shows what is projected
  using Shown = std::pair<std::size_t, std::uint8_t>;  ///< pose, gray level of the first tag

  /// What is in front of the camera now. The pattern is told from gray by a pixel of its own.
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
        shown.second == 255 ? test::patternPicture(rig_.pattern)
                            : grayPicture(rig_.pattern.width, rig_.pattern.height, shown.second);
    const auto seed = static_cast<std::uint32_t>(7 * shown.first + shown.second);
    return album_[shown] = photographer_.photograph(poses_[shown.first], light, seed);
  }

  void film() {
    std::vector<Shown> on_the_way(kLag_frames, {0, 0});
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

  const SyntheticRig rig_;
  Photographer photographer_;
  const std::vector<BoardPose> poses_;
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

}  // namespace afterglow::test
