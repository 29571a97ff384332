/// \file
/// What has arrived for a bystander since they last looked. ROS callbacks only store.
#pragma once

#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <std_msgs/String.h>
#include <visualization_msgs/MarkerArray.h>

#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace afterglow::nodes {

struct ObserverNews {
  std::deque<visualization_msgs::MarkerArray::ConstPtr> solids;  ///< all, in order
  std::deque<sensor_msgs::Image::ConstPtr> images;               ///< the newest few, in order
  sensor_msgs::CameraInfo::ConstPtr camera_info;                 ///< the newest, or empty
  std::optional<std::string> caption, speech, look;              ///< the newest, if new
  std::deque<std::string> key_frames;                            ///< names, in order
};

/// Safe from any thread; the callbacks run in the caller's spinner.
class ObserverInbox {
 public:
  ObserverInbox(ros::NodeHandle node, ros::NodeHandle own);
  ObserverNews take();

 private:
  void onSolids(const visualization_msgs::MarkerArray::ConstPtr& solids);
  void onImage(const sensor_msgs::Image::ConstPtr& image);
  void onCameraInfo(const sensor_msgs::CameraInfo::ConstPtr& info);
  void onCaption(const std_msgs::String& caption);
  void onSpeech(const std_msgs::String& speech);
  void onLook(const std_msgs::String& name);
  void onKeyFrame(const std_msgs::String& name);

  std::mutex mutex_;
  ObserverNews news_;
  std::vector<ros::Subscriber> subscribers_;
};

}  // namespace afterglow::nodes
