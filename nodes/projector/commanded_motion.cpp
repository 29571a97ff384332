#include "nodes/projector/commanded_motion.hpp"

#include <algorithm>
#include <cmath>

#include "nodes/projector/layer_config.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::int64_t kKeptNs = 1'000'000'000, kStepNs = 1'000'000;
constexpr double kGreatestAcceleration = 100;  // m/s^2, rad/s^2
constexpr double kGreatestDelay = 500;         // ms

double seconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }

}  // namespace

const std::vector<std::string> kBaseKeys = {"commands", "frame", "linear_acceleration",
                                            "angular_acceleration", "delay_ms"};

BaseConfig readBaseConfig(const YamlMap& map) {
  BaseConfig config;
  config.command_topic = map.text("commands");
  if (config.command_topic.front() != '/') {
    map.fail(map.at("commands"), "'commands' of 'base' is a topic: it should begin with '/'");
  }
  if (map.has("frame")) config.frame = readFrame(map, "frame");
  config.linear_acceleration = map.number("linear_acceleration", 0.01, kGreatestAcceleration);
  config.angular_acceleration = map.number("angular_acceleration", 0.01, kGreatestAcceleration);
  config.delay_ns = std::llround(map.number("delay_ms", 0, kGreatestDelay, 0) * 1e6);
  return config;
}

void CommandedMotion::add(const geometry_msgs::Twist& command, std::int64_t arrived_ns) {
  const Eigen::Vector3d wanted(command.linear.x, command.linear.y, command.angular.z);
  if (!wanted.allFinite()) return;
  const std::int64_t due_ns = arrived_ns + config_.delay_ns;
  commands_.push_back({due_ns, wanted, velocityAt(due_ns)});
  while (commands_.front().due_ns < due_ns - kKeptNs) commands_.pop_front();
}

/// Zero before the first command, and where the last one is so old that a base has stopped.
Eigen::Vector3d CommandedMotion::velocityAt(std::int64_t stamp_ns) const {
  const auto after = std::upper_bound(
      commands_.begin(), commands_.end(), stamp_ns,
      [](std::int64_t stamp, const Command& command) { return stamp < command.due_ns; });
  if (after == commands_.begin()) return Eigen::Vector3d::Zero();
  const Command& last = *(after - 1);
  const std::int64_t since_ns = stamp_ns - last.due_ns;
  if (since_ns > replay::kVelocityHoldsNs) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d most =
      seconds(since_ns) * Eigen::Vector3d(config_.linear_acceleration, config_.linear_acceleration,
                                          config_.angular_acceleration);
  return last.then + (last.wanted - last.then).cwiseMax(-most).cwiseMin(most);
}

Eigen::Isometry3d CommandedMotion::departure(std::int64_t from_ns, std::int64_t to_ns,
                                             std::int64_t when_ns) const {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  if (commands_.empty() || when_ns - commands_.back().due_ns > replay::kVelocityHoldsNs) {
    return pose;
  }
  const auto meant = [&](std::int64_t begin_ns, std::int64_t end_ns) {
    Eigen::Vector3d way = Eigen::Vector3d::Zero();
    for (std::int64_t ns = begin_ns; ns < end_ns; ns += kStepNs) {
      const std::int64_t step_ns = std::min(kStepNs, end_ns - ns);
      way += seconds(step_ns) * velocityAt(ns + step_ns / 2);
    }
    return way;
  };
  const double share = seconds(when_ns - to_ns) / seconds(to_ns - from_ns);
  const Eigen::Vector3d way = meant(to_ns, when_ns) - share * meant(from_ns, to_ns);
  pose.translate(Eigen::Vector3d(way.x(), way.y(), 0));
  pose.rotate(Eigen::AngleAxisd(way.z(), Eigen::Vector3d::UnitZ()));
  return pose;
}

}  // namespace afterglow::nodes
