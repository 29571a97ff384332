/// \file
/// The joint trajectory in a goal or command, and the rest of an interrupted one, to go on with
/// after a pause or from the middle.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "replay/messages/document.hpp"
#include "replay/messages/message.hpp"

namespace afterglow::replay {

struct Trajectory {
  std::vector<std::string> joints;
  Array* points;  ///< the points within the document
};

/// Returns the trajectory at goal.trajectory of an action goal, or the whole message; empty if
/// there is none.
std::optional<Trajectory> trajectoryIn(Value& document);
/// 0 if the point has none.
std::int64_t timeFromStartNs(const Value& point);
double secondsOf(const Value& point);

/// A joint trajectory goal or command loses the points that had passed `elapsed_ns` after it was
/// sent; the rest comes as much earlier, but `lead_ns` later: time to get there from elsewhere. If
/// all had passed, the last point stays, to be reached in that time, or shortly. Every other goal
/// (gripper, point head) holds a target and is returned as it was. Times are the recording's.
Bytes remainderOfGoal(const Channel& channel, const Bytes& goal, std::int64_t elapsed_ns,
                      std::int64_t lead_ns = 0);

/// The trajectory command that halts its joints where they are: no points.
Bytes haltedTrajectory(const Channel& channel, const Bytes& command);

/// control_msgs/PointHeadActionGoal, or PR2's
bool isHeadGoal(const Channel& channel);
/// The least that a head's goal takes; 0 if it does not say.
std::int64_t shortestDurationNs(const Channel& channel, const Bytes& goal);
/// The goal of a head with this mean velocity at most, rad/s: one that goes on from elsewhere has
/// another way than it had.
Bytes noFaster(const Channel& channel, const Bytes& head_goal, double velocity);
/// The head's goal to keep its gaze, made of one of its goals: straight ahead in `gaze_frame`, the
/// frame that looks along its x axis. It ends a fault of Fetch's controller, which after a
/// cancel would jump to the next goal's target (robot_controllers issue 33). Throws MessageError.
Bytes presentGaze(const Channel& channel, const Bytes& goal, const std::string& gaze_frame,
                  const std::string& goal_id);

}  // namespace afterglow::replay
