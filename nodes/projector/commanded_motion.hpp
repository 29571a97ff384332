/// \file
/// The motion that a base's velocity commands announce before tf shows it. A base speeds up at a
/// known rate, so its next moments follow from the commands it has; those to come nobody knows.
#pragma once

#include <geometry_msgs/Twist.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "nodes/tools/yaml_map.hpp"

namespace afterglow::nodes {

/// The `base` block of a projector's configuration.
struct BaseConfig {
  std::string command_topic;        ///< geometry_msgs/Twist
  std::string frame = "base_link";  ///< REP 103: x ahead
  double linear_acceleration = 0;   ///< m/s^2
  double angular_acceleration = 0;  ///< rad/s^2
  std::int64_t delay_ns = 0;        ///< time from a command to its effect
};

/// The block's keys.
extern const std::vector<std::string> kBaseKeys;
/// Throws std::runtime_error "FILE:LINE: what is wrong".
BaseConfig readBaseConfig(const YamlMap& map);

/// Commands in the order of their arrival. One thread at a time.
class CommandedMotion {
 public:
  explicit CommandedMotion(BaseConfig config) : config_(std::move(config)) {}

  const BaseConfig& config() const { return config_; }
  /// Commands that are not finite are passed over.
  void add(const geometry_msgs::Twist& command, std::int64_t arrived_ns);
  void clear() { commands_.clear(); }
  /// Returns where the base will be, in its own frame, as seen from where it would be if it went
  /// on from `to_ns` to `when_ns` as it moved on average from `from_ns` to `to_ns`. The identity
  /// where no command says otherwise: a base that does not obey is taken for one that goes on.
  Eigen::Isometry3d departure(std::int64_t from_ns, std::int64_t to_ns,
                              std::int64_t when_ns) const;

 private:
  struct Command {
    std::int64_t due_ns;
    Eigen::Vector3d wanted, then;  ///< ahead, left (m/s), turn (rad/s): asked for; as it is due
  };
  Eigen::Vector3d velocityAt(std::int64_t stamp_ns) const;

  const BaseConfig config_;
  std::deque<Command> commands_;  ///< those of the last second
};

}  // namespace afterglow::nodes
