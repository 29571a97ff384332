#include "nodes/player/rehearsal.hpp"

#include <fmt/format.h>

#include <exception>
#include <optional>

#include "nodes/player/robot_services.hpp"
#include "nodes/player/stop_inputs.hpp"
#include "replay/plan/permission.hpp"

namespace afterglow::nodes {
namespace {

using Start = BodyOptions::Start;
using IsStopped = std::function<bool()>;

/// The rehearsal of one replay whose robot is there.
struct StartRehearsal {
  const replay::Store& store;
  const replay::PlayPlan& plan;
  const BodyOptions& options;
  const replay::MovedParts& parts;
  ReplayedBase* base;  ///< nullptr: the base is not moved
  const IsStopped& is_stopped;
  Rehearsal& rehearsal;

  void refuseAsItStands(const std::string& deviation) const {
    rehearsal.add(replay::whyElsewhere({}, deviation, options.start == Start::MoveThere));
  }

  void lookAtBase(const replay::StartPose& then, const replay::StartPose& now) const {
    std::string deviation = base ? replay::baseDeviation(then, now, options.tolerances)
                                 : baseDeviationAtALook(then, now, options.tolerances);
    if (deviation.empty()) return;
    if (!base || !now.base) return refuseAsItStands(deviation);
    replay::StartPose mean;
    mean.base = base->measure(ReplayedBase::kMeanOf, is_stopped);
    const replay::PoseError doubt = base->startDoubt(then.base_share);
    deviation = replay::baseDeviation(then, mean, widened(options.tolerances, doubt));
    const bool is_near =
        mean.base && distance(*mean.base, *then.base) <= ReplayedBase::kFarthestStart;
    if (deviation.empty()) return;
    if (options.start != Start::MoveThere) return refuseAsItStands(deviation);
    if (is_near) return rehearsal.unchecked.push_back("the base's way to the start");
    refuseAsItStands(fmt::format("{}; --to-start drives at most {} m", deviation,
                                 ReplayedBase::kFarthestStart));
  }

  void lookAtJoints(const replay::StartPose& then, const replay::StartPose& now) const {
    const auto deviations = jointDeviations(then, now, options.tolerances);
    if (deviations.empty()) return;
    if (options.start != Start::MoveThere) {
      return rehearsal.add(replay::whyElsewhere(deviations, "", false));
    }
    if (StateValidity(options.base.robot).isThere()) {
      return rehearsal.unchecked.push_back("whether MoveIt finds the way to the start free");
    }
    const replay::Approach approach = readApproach(store, plan, options);
    for (const replay::JointGoals& goals : parts.goals) {
      try {
        (void)startGoal(goals, then, now, options.tolerances, approach, plan.begin, "", {});
      } catch (const std::exception& error) {
        rehearsal.add("to the start, " + std::string(error.what()));
      }
    }
  }

  void look() const {
    std::vector<std::string> remarks;  // a report's
    const replay::StartPose then = startToCompare(store, plan, options, parts, base, remarks);
    const replay::StartPose now =
        askStart(options, parts, then, base ? base->frames() : options.base.frames, is_stopped);
    const std::string lacks = whyNoJoints(options, parts, now);
    rehearsal.add(lacks);
    if (options.start == Start::Anywhere) return;
    lookAtBase(then, now);
    if (lacks.empty()) lookAtJoints(then, now);
  }
};

}  // namespace

void Rehearsal::ask(const std::function<void()>& check) {
  try {
    check();
  } catch (const replay::MotionRefused& refusal) {
    add(refusal.why);
  } catch (const std::exception& error) {
    add(error.what());
  }
}

void rehearseBody(const replay::Store& store, const replay::PlayPlan& plan,
                  const BodyOptions& options, bool has_master, const IsStopped& is_stopped,
                  Rehearsal& rehearsal) {
  const replay::MovedParts parts = movedParts(store, plan, options.joints);
  rehearsal.add(whyUnnamed(parts, options));
  std::optional<ReplayedBase> base;
  if (movesBase(plan, parts)) {
    rehearsal.ask([&] { base.emplace(store, plan, options.base, options.limits); });
  }
  if (base) {
    rehearsal.add(has_master ? base->refusal(is_stopped) : base->recordedRefusal());
    const std::string blind = has_master ? base->checkScan(is_stopped, {}) : base->scanRefusal();
    if (base->isPlayed()) rehearsal.add(blind);
    rehearsal.slowed = base->slowedDrives();
  }
  const bool has_stop = !options.stops.emergency_stop.topic.empty();
  if (!has_master) {
    auto& unchecked = rehearsal.unchecked;
    unchecked.push_back("who hears the robot's topics");
    if (has_stop) unchecked.push_back("the emergency stop " + options.stops.emergency_stop.text());
    if (base) unchecked.push_back("where the base is now and what its scan sees");
    if (options.start != Start::Anywhere) unchecked.push_back("whether it stands as it did");
    return;
  }
  rehearsal.ask([&] {
    for (const std::string& lack :
         missingControllers(plan, options.robot, askMaster(deadlineIn(kMasterPatience)))) {
      rehearsal.add(lack);
    }
  });
  if (has_stop) {
    rehearsal.ask([&] {
      EmergencyStop(options.stops.emergency_stop, [](const std::string&) {}).check();
    });
  }
  rehearsal.ask([&] {
    StartRehearsal{store, plan, options, parts, base ? &*base : nullptr, is_stopped, rehearsal}
        .look();
  });
}

}  // namespace afterglow::nodes
