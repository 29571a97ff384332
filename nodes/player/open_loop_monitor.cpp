#include "nodes/player/open_loop_monitor.hpp"

#include <fmt/format.h>

#include <utility>

#include "nodes/player/ros_clock.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::nodes {

OpenLoopMonitor::OpenLoopMonitor(const replay::PlayPlan& plan, replay::MessageSink& sink,
                                 const replay::ObstacleOptions& options,
                                 std::function<replay::BaseInput()> look,
                                 std::function<void(const std::string&)> stop)
    : sink_(sink),
      obstacles_(options, "the base's frame"),
      look_(std::move(look)),
      stop_(std::move(stop)) {
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (topic.isPlayed() && isVelocity(topic.channel)) topics_.insert(topic.output.topic);
  }
}

bool OpenLoopMonitor::publish(const replay::Channel& channel, const replay::Bytes& bytes) {
  if (topics_.count(channel.topic) == 0 || replay::isZero(replay::velocityOf(bytes))) {
    return sink_.publish(channel, bytes);
  }
  const std::string why_not = whyNot(bytes);
  if (why_not.empty()) return sink_.publish(channel, bytes);
  stop_("the base, which cannot wait in open loop: " + why_not);
  return sink_.publish(channel, replay::velocityMessage(bytes, {}, rosStampNow()));
}

/// Returns why the base must not be told this velocity; empty if it may.
std::string OpenLoopMonitor::whyNot(const replay::Bytes& bytes) {
  const replay::Velocity velocity = replay::velocityOf(bytes);
  const replay::PlanarVelocity wanted{velocity[0], velocity[5], velocity[1]};
  const replay::ObstacleOptions& options = obstacles_.options();
  const double radius = options.footprint.radius();
  const double speed = replay::rimSpeed(wanted, radius);
  const double way = obstacles_.wayToStop(speed);
  const replay::BaseInput input = look_();
  const replay::PlanarPose T_odom_base =
      input.T_odom_base ? input.T_odom_base->pose : replay::PlanarPose();
  if (input.T_odom_base) obstacles_.move(input.T_odom_base->stamp, T_odom_base);
  obstacles_.hear(input.scan);
  const auto verdict = obstacles_.judge({input.now, T_odom_base, {}, input.now, 0},
                                        pathOf(wanted, radius, way));
  if (verdict.kind != replay::ObstacleStop::Verdict::Kind::Go) return verdict.reason;
  if (verdict.speed >= speed) return "";
  return verdict.is_unseen && verdict.speed == options.unseen_speed
             ? fmt::format("{:.2f} m/s where the scan does not look are too fast", speed)
             : fmt::format("something in its way is too near for {:.2f} m/s", speed);
}

}  // namespace afterglow::nodes
