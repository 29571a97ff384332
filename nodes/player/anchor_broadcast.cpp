#include "nodes/player/anchor_broadcast.hpp"

#include <boost/function.hpp>
#include <chrono>
#include <exception>
#include <stdexcept>
#include <thread>
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
             [this](const tf2_msgs::TFMessage& transforms) { publish(transforms); }),
      spinner_(1, &queue_) {
  world_.readAhead(plan.begin);
  using Event = ros::MessageEvent<const tf2_msgs::TFMessage>;
  node_.setCallbackQueue(&queue_);
  publisher_ = node_.advertise<tf2_msgs::TFMessage>("/tf", kTransformQueue);
  const boost::function<void(const Event&)> take = [this](const Event& event) {
    onTransforms(event);
  };
  for (const char* topic : {"/tf", "/tf_static"}) {
    subscribers_.push_back(node_.subscribe<tf2_msgs::TFMessage>(topic, kTransformQueue, take));
  }
  timer_ = node_.createWallTimer(ros::WallDuration(kPeriod_s), [this](const auto&) { onTimer(); });
  spinner_.start();
}

AnchorBroadcast::~AnchorBroadcast() {
  timer_.stop();
  for (ros::Subscriber& subscriber : subscribers_) subscriber.shutdown();
  spinner_.stop();
}

bool AnchorBroadcast::waitForAnchor(Deadline deadline,
                                    const std::function<bool()>& is_stopped) const {
  while (!has_anchor_ && !is_stopped() && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return has_anchor_;
}

void AnchorBroadcast::anchor(const replay::Channel& channel, replay::Stamp received,
                             const replay::PublishMoment& moment, replay::Bytes& bytes) {
  world_.anchor(channel, received, moment, bytes);
}

void AnchorBroadcast::onTransforms(const ros::MessageEvent<const tf2_msgs::TFMessage>& event) {
  if (has_anchor_ || event.getPublisherName() == ros::this_node::getName()) return;
  for (const geometry_msgs::TransformStamped& transform : event.getConstMessage()->transforms) {
    if (frameName(transform.header.frame_id) == anchor_ ||
        frameName(transform.child_frame_id) == anchor_) {
      has_anchor_ = true;
    }
  }
  if (has_anchor_) {
    for (ros::Subscriber& subscriber : subscribers_) subscriber.shutdown();
  }
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
