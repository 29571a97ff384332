/// \file
/// The messages that stop what a topic has set in motion.
#pragma once

#include <optional>
#include <vector>

#include "replay/messages/field_edit.hpp"
#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"
#include "replay/plan/motion_stop.hpp"
#include "replay/plan/play_plan.hpp"

namespace afterglow::replay {

/// Makes stops for one topic; its definition is looked at once. Any thread.
class StopMaker {
 public:
  /// `output`: the topic as it is published. Throws MessageError for a definition that is none, or
  /// a rule that does not fit it.
  StopMaker(const Channel& output, const MotionStop& stop);

  const MotionStop& stop() const { return stop_; }
  bool isSetPoint() const { return stop_.isSetPoint(); }
  /// False: nothing has to be sent, or it is not known what.
  bool hasMessage() const;
  /// The channel on which the stop is published: the topic itself, or that of a cancel.
  const Channel& channel() const { return channel_; }

  /// Returns the message that stops the motion of this one, the last on the topic. Empty without a
  /// message; throws MessageError for bytes that do not fit.
  Bytes after(const Bytes& last) const;
  /// The same while nothing has been sent.
  Bytes before() const;
  /// Returns true if a message moves nothing: it is the stop itself. False for bytes that do not
  /// fit.
  bool isNeutral(const Bytes& message) const;

 private:
  bool setFields(Bytes& message) const;

  MotionStop stop_;
  Channel channel_;
  std::optional<Schema> schema_;  ///< schema of stops that are made of the last message
  std::vector<double> values_;    ///< values by path
  std::optional<FieldFinder> finder_;
};

/// The JointTrajectory topic of the controller that an action's goals are for: ros_controllers'
/// joint trajectory controllers go on with the trajectory of a goal that they have aborted, and no
/// cancel reaches it any more (ros_controllers issues 48, 461). A trajectory without points on
/// `<controller>/command` halts them, and PR2's. Empty for other actions. Whether such a controller
/// is there shows who hears the topic.
std::optional<Channel> haltChannel(const Channel& goal);
/// A gripper's goal to stay at the gap it has, made of its last one, with its effort: a cancel may
/// leave it moving (Fetch's driver). Throws MessageError.
Bytes gapGoal(const Channel& channel, const Bytes& last, double gap);
/// A trajectory without joints and points.
Bytes haltMessage();

}  // namespace afterglow::replay
