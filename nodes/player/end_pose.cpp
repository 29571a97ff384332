#include "nodes/player/end_pose.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace afterglow::nodes {
namespace {

/// A goal may have been under way when the behavior ended; its replay is waited for, too.
replay::Stamp settledAt(const replay::PlayPlan& plan, const replay::PlayReport& report) {
  replay::Stamp end = plan.end;
  for (const replay::GoalSpan& goal : report.goal_spans) {
    if (!goal.recorded_end_s) continue;
    const auto into = static_cast<std::int64_t>(std::llround(*goal.recorded_end_s * 1e9));
    end = std::max(end, replay::Stamp{plan.behavior.begin.ns + into});
  }
  return end;
}

}  // namespace

replay::BodyEnd compareEnds(const replay::StartPose& then, const replay::StartPose& now) {
  replay::BodyEnd end;
  for (const auto& [joint, position] : then.joints) {
    if (then.robot.mimicOf(joint)) continue;
    const auto live = now.joints.find(joint);
    if (live == now.joints.end()) {
      end.remarks.push_back("nobody told where " + joint + " was at the end");
    } else {
      end.joints[joint] = then.robot.way(joint, position, live->second);
      if (then.robot.isSliding(joint)) end.sliding.insert(joint);
    }
  }
  if (then.base && now.base) {
    end.base = {distance(*then.base, *now.base),
                std::abs(replay::wrapAngle(now.base->yaw - then.base->yaw))};
  } else if (then.base) {
    end.remarks.push_back("nobody told where the base was at the end (tf)");
  }
  return end;
}

void addEnd(const replay::Store& store, const replay::PlayPlan& plan, const BodyOptions& options,
            const std::map<std::string, double>& joints, const std::function<bool()>& is_stopped,
            replay::PlayReport& report) try {
  const replay::TrackFrames& frames = options.base.frames;
  std::vector<std::string> remarks;
  replay::MovedParts parts = movedParts(store, plan, options.joints);
  // The drive has looked for longer than this would.
  parts.moves_base = parts.moves_base && !baseEnd(report);
  const replay::StartPose then =
      readEndPose(store, plan, parts, settledAt(plan, report), remarks, frames);
  replay::StartPose now =
      askStart(options, replay::MovedParts(), then, liveFrames(options.base, plan), is_stopped);
  now.joints.insert(joints.begin(), joints.end());
  replay::BodyEnd end = compareEnds(then, now);
  end.remarks.insert(end.remarks.begin(), remarks.begin(), remarks.end());
  report.body_end = std::move(end);
} catch (const std::exception& error) {
  report.notes.push_back(std::string("how the robot ended was not measured: ") + error.what());
}

}  // namespace afterglow::nodes
