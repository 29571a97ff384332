#include "nodes/projector/transform_inbox.hpp"

#include <boost/function.hpp>
#include <cstdint>
#include <string>

#include "nodes/projector/transform_intake.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::uint32_t kQueue = 100;           // tf2_ros's
constexpr std::uint64_t kJumpNs = 500'000'000;  // less is a clock being set right

}  // namespace

TransformInbox::TransformInbox(tf2::BufferCore& buffer) : buffer_(buffer), counts_("/tf", 1, {}) {
  using Event = ros::MessageEvent<const tf2_msgs::TFMessage>;
  nh_.setCallbackQueue(&queue_);
  const boost::function<void(const Event&)> moving = [this](const Event& e) { take(e, false); };
  const boost::function<void(const Event&)> fixed = [this](const Event& e) { take(e, true); };
  moving_ = nh_.subscribe<tf2_msgs::TFMessage>("/tf", kQueue, moving);
  fixed_ = nh_.subscribe<tf2_msgs::TFMessage>("/tf_static", kQueue, fixed);
  spinner_.start();
}

TransformInbox::~TransformInbox() { spinner_.stop(); }

void TransformInbox::take(const ros::MessageEvent<const tf2_msgs::TFMessage>& event,
                          bool is_static) {
  const ros::Time now = ros::Time::now();
  if (now.toNSec() + kJumpNs < last_time_.toNSec()) {
    ROS_WARN("ROS time has jumped back: transforms are forgotten");
    buffer_.clear();
  }
  last_time_ = now;
  const std::lock_guard<std::mutex> lock(mutex_);
  counts_.countMessage();
  for (const geometry_msgs::TransformStamped& transform : event.getConstMessage()->transforms) {
    const Intake taken =
        takeTransform(buffer_, transform, event.getPublisherName(), is_static, now);
    if (!taken.is_stored) {
      counts_.drop(taken.reason);
    } else if (!taken.reason.empty()) {
      counts_.remark(taken.reason);
    }
  }
}

LayerStatus TransformInbox::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return counts_.status();
}

}  // namespace afterglow::nodes
