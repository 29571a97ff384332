/// \file
/// The stance of the robot when a replay is over, against how it stood when that was recorded.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "nodes/player/body_gate.hpp"
#include "replay/motion/arm/start_pose.hpp"
#include "replay/play/play_report.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// The errors at the end. Joints that `now` lacks become a remark.
replay::BodyEnd compareEnds(const replay::StartPose& then, const replay::StartPose& now);

/// Reads what was recorded at the end of what was played, or when its last goal had been reached,
/// and asks the robot (/joint_states; tf, unless a drive has found where the base ended). Takes 3 s
/// if nobody answers, at most until `is_stopped`; joints that nobody tells of by then are where
/// they were heard of last, in `joints`. Adds the errors to the report, or why they are not known.
void addEnd(const replay::Store& store, const replay::PlayPlan& plan, const BodyOptions& options,
            const std::map<std::string, double>& joints, const std::function<bool()>& is_stopped,
            replay::PlayReport& report);

}  // namespace afterglow::nodes
