#include "nodes/observer/observer_inbox.hpp"

#include <utility>

namespace afterglow::nodes {
namespace {

constexpr std::size_t kMostSolids = 1000, kMostImages = 4, kMostKeyFrames = 100;

template <typename Value>
void put(std::deque<Value>& queue, const Value& value, std::size_t most) {
  queue.push_back(value);
  if (queue.size() > most) queue.pop_front();
}

}  // namespace

ObserverInbox::ObserverInbox(ros::NodeHandle node, ros::NodeHandle own) {
  const auto no_delay = ros::TransportHints().tcpNoDelay();
  subscribers_ = {
      node.subscribe("/room/solids", 100, &ObserverInbox::onSolids, this),
      node.subscribe("/projector/image", 2, &ObserverInbox::onImage, this, no_delay),
      node.subscribe("/projector/camera_info", 2, &ObserverInbox::onCameraInfo, this),
      own.subscribe("caption", 10, &ObserverInbox::onCaption, this),
      node.subscribe("/speaker_node/state", 10, &ObserverInbox::onSpeech, this),
      own.subscribe("look", 10, &ObserverInbox::onLook, this),
      own.subscribe("key_frame", 100, &ObserverInbox::onKeyFrame, this),
  };
}

ObserverNews ObserverInbox::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(news_, {});
}

void ObserverInbox::onSolids(const visualization_msgs::MarkerArray::ConstPtr& solids) {
  const std::lock_guard<std::mutex> lock(mutex_);
  put(news_.solids, solids, kMostSolids);
}

void ObserverInbox::onImage(const sensor_msgs::Image::ConstPtr& image) {
  const std::lock_guard<std::mutex> lock(mutex_);
  put(news_.images, image, kMostImages);
}

void ObserverInbox::onCameraInfo(const sensor_msgs::CameraInfo::ConstPtr& info) {
  const std::lock_guard<std::mutex> lock(mutex_);
  news_.camera_info = info;
}

void ObserverInbox::onCaption(const std_msgs::String& caption) {
  const std::lock_guard<std::mutex> lock(mutex_);
  news_.caption = caption.data;
}

void ObserverInbox::onSpeech(const std_msgs::String& speech) {
  const std::lock_guard<std::mutex> lock(mutex_);
  news_.speech = speech.data;
}

void ObserverInbox::onLook(const std_msgs::String& name) {
  const std::lock_guard<std::mutex> lock(mutex_);
  news_.look = name.data;
}

void ObserverInbox::onKeyFrame(const std_msgs::String& name) {
  const std::lock_guard<std::mutex> lock(mutex_);
  put(news_.key_frames, name.data, kMostKeyFrames);
}

}  // namespace afterglow::nodes
