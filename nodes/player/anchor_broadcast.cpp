#include "nodes/player/anchor_broadcast.hpp"

#include <exception>
#include <stdexcept>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::uint32_t kTransformQueue = 100;  // tf2_ros's
constexpr double kPeriod_s = 1.0 / 30;

}  // namespace

AnchorBroadcast::AnchorBroadcast(const replay::Store& store, const replay::PlayPlan& plan,
                                 const replay::AnchorSettings& settings, Position position)
    : anchor_(plan.rewriting.frame(settings.frame)),
      position_(std::move(position)),
      world_(store, plan, settings,
             [this](const tf2_msgs::TFMessage& transforms) { publish(transforms); }) {
  world_.readAhead(plan.begin);
  publisher_ = node_.advertise<tf2_msgs::TFMessage>("/tf", kTransformQueue);
  for (const char* topic : {"/tf", "/tf_static"}) {
    thread_.hear<Event>(topic, kTransformQueue,
                        [this](const Event& event) { onTransforms(event); });
  }
  thread_.every(kPeriod_s, [this] { onTimer(); });
  thread_.begin();
}

void AnchorBroadcast::anchor(const replay::Channel& channel, replay::Stamp received,
                             const replay::PublishMoment& moment, replay::Bytes& bytes) {
  world_.anchor(channel, received, moment, bytes);
}

void AnchorBroadcast::onTransforms(const Event& event) {
  if (has_anchor_ || event.getPublisherName() == ros::this_node::getName()) return;
  for (const geometry_msgs::TransformStamped& transform : event.getConstMessage()->transforms) {
    if (frameName(transform.header.frame_id) == anchor_ ||
        frameName(transform.child_frame_id) == anchor_) {
      has_anchor_ = true;
    }
  }
  if (has_anchor_) thread_.hearNoMore();
}

void AnchorBroadcast::publish(const tf2_msgs::TFMessage& transforms) {
  if (!has_anchor_) {
    throw std::runtime_error("today's tf has no frame '" + anchor_ +
                             "' (--anchor-frame) for light to stay in place in");
  }
  publisher_.publish(transforms);
}

void AnchorBroadcast::onTimer() {
  const std::optional<Moment> moment = position_();
  if (!moment || !has_anchor_) return;
  try {
    world_.repeat(moment->recorded, moment->now);
  } catch (const std::exception& error) {
    ROS_WARN_THROTTLE(10, "recorded frames: %s", error.what());
  }
}

}  // namespace afterglow::nodes
