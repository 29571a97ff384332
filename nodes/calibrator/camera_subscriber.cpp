#include "nodes/calibrator/camera_subscriber.hpp"

#include <stdexcept>
#include <utility>

#include "nodes/calibrator/pattern_screen.hpp"
#include "nodes/conversion/camera_messages.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::chrono::seconds kSilence{3};  // slow cameras send once a second

}  // namespace

CameraSubscriber::CameraSubscriber(const std::string& image_topic,
                                   const std::string& camera_info_topic,
                                   const std::optional<calib::Lens>& lens)
    : image_topic_(ros::names::resolve(image_topic)),
      camera_info_topic_(camera_info_topic.empty() ? "" : ros::names::resolve(camera_info_topic)),
      began_at_(std::chrono::steady_clock::now()),
      lens_(lens),
      heard_at_(began_at_) {
  image_subscriber_ = nh_.subscribe(image_topic_, 1, &CameraSubscriber::onImage, this,
                                    ros::TransportHints().tcpNoDelay());
  if (lens || camera_info_topic.empty()) return;
  camera_info_subscriber_ =
      nh_.subscribe(camera_info_topic_, 1, &CameraSubscriber::onCameraInfo, this);
}

void CameraSubscriber::onImage(const sensor_msgs::ImageConstPtr& message) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    newest_ = message;
    arrived_ = readClocks();
    heard_at_ = std::chrono::steady_clock::now();
    was_heard_ = true;
  }
  image_came_.notify_one();
}

void CameraSubscriber::onCameraInfo(const sensor_msgs::CameraInfoConstPtr& message) {
  std::string problem;
  std::optional<calib::Lens> lens;
  try {
    lens = toLens(*message);
  } catch (const std::invalid_argument& error) {
    problem = error.what();
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  lens_problem_ = problem;
  if (lens) lens_ = lens;
}

std::optional<CameraImage> CameraSubscriber::take(std::chrono::nanoseconds patience) {
  sensor_msgs::ImageConstPtr message;
  CameraImage image;
  {
    std::unique_lock<std::mutex> lock(mutex_);
    image_came_.wait_for(lock, patience, [this] { return newest_ != nullptr; });
    message = std::exchange(newest_, nullptr);
    image.arrived = arrived_;
  }
  if (!message) return std::nullopt;
  std::string problem;
  try {
    image.picture = toPicture(*message);
  } catch (const std::invalid_argument& error) {
    problem = image_topic_ + ": " + error.what();
  }
  const ros::Time stamp = message->header.stamp;
  image.stamp_ns =
      stamp.isZero() ? image.arrived.wall_ns : static_cast<std::int64_t>(stamp.toNSec());
  image.frame_id = message->header.frame_id;
  const std::lock_guard<std::mutex> lock(mutex_);
  image_problem_ = problem;
  if (!problem.empty()) return std::nullopt;
  return image;
}

std::optional<calib::Lens> CameraSubscriber::lens() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return lens_;
}

std::string CameraSubscriber::problem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!image_problem_.empty()) return image_problem_;
  if (!lens_problem_.empty()) return lens_problem_;
  const auto now = std::chrono::steady_clock::now();
  if (!lens_ && !camera_info_topic_.empty() && now - began_at_ > kSilence)
    return "no camera_info on " + camera_info_topic_;
  if (now - heard_at_ < kSilence) return {};
  if (was_heard_) return "the camera has stopped: nothing on " + image_topic_ + " for 3 s";
  return "no image on " + image_topic_ + ": is the camera running, and is that its topic?";
}

}  // namespace afterglow::nodes
