/// \file
/// The changes of a message at another rate, so that a body goes the same way faster or slower:
/// velocities times the rate, accelerations times its square, durations divided by it. Efforts and
/// tolerances stay as they were. Lifetimes of markers are durations, too. A head goal that asks for
/// no velocity would be as fast at every rate: at a lower one it gets one.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "replay/messages/field_edit.hpp"
#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::replay {

struct PlannedTopic;
struct PlayPlan;

/// A number or duration to be multiplied by rate^power.
struct ScaledField {
  std::string path;  ///< a FieldPath; below an array, every element
  int power;
  double instead_of_0 = 0;  ///< value at rates below 1, as 0 there says "as fast as it goes"
};

/// Known by the types they lie in, wherever those are nested: geometry_msgs/Twist, trajectory
/// points, PointHead and SingleJointPosition goals, AckermannDrive, Marker. Where the numbers of a
/// message are joints' velocities by the controller's name, its `data`.
std::vector<ScaledField> scaledFields(const Schema& schema, bool has_joint_velocities = false);

/// Returns true if the numbers of a Float64 or Float64MultiArray are joints' velocities.
bool hasJointVelocities(const PlannedTopic& topic);

/// Returns a line that names a topic of set points whose velocities are not known, so that they can
/// be neither changed nor limited; empty: there is none. Targets (goals, poses) have no rate of
/// their own.
std::string whyOnlyAsRecorded(const PlayPlan& plan);

/// Worked out once for a type.
class MotionRate {
 public:
  explicit MotionRate(const Schema& schema, bool has_joint_velocities = false);

  /// Throws MessageError if the bytes do not fit the schema, or a duration becomes longer than ROS
  /// can say.
  void apply(Bytes& bytes, double rate) const;

 private:
  std::vector<ScaledField> fields_;
  std::optional<FieldFinder> finder_;  ///< empty without fields
};

}  // namespace afterglow::replay
