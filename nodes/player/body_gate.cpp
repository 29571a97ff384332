#include "nodes/player/body_gate.hpp"

#include <fmt/format.h>
#include <ros/ros.h>

#include <chrono>
#include <set>
#include <thread>
#include <utility>

#include "nodes/player/robot_services.hpp"
#include "nodes/player/ros_clock.hpp"
#include "nodes/player/watchdog.hpp"
#include "replay/messages/ranges.hpp"
#include "replay/motion/goal_book.hpp"
#include "replay/motion/goal_remainder.hpp"
#include "replay/motion/stops/stop_maker.hpp"
#include "replay/plan/permission.hpp"
#include "replay/plan/rewrite.hpp"

namespace afterglow::nodes {
namespace {

using replay::GoalOutcome;

constexpr std::chrono::milliseconds kGoalLook(20);  // at a goal that is under way
constexpr double kLivePatience = 3.0;               // s
/// The time beyond what a goal was given to get to the start.
constexpr double kLongestApproach = 90;  // s

/// Nothing for an empty clause.
void refuseFor(const std::string& why) {
  if (!why.empty()) throw replay::MotionRefused(why);
}

replay::Approach::Rules rulesOf(const BodyOptions& options) {
  return {options.speed, options.limits, options.accepts_unchecked, options.joints,
          options.tolerances};
}

const char* wayText(replay::JointWay::Kind kind) {
  using Kind = replay::JointWay::Kind;
  return kind == Kind::Recorded    ? ", as it was recorded on its way there"
         : kind == Kind::Checked   ? ", straight, where MoveIt finds the way free"
         : kind == Kind::Unchecked ? ", straight, on a way that nobody has checked"
                                   : "";
}

/// A joint that only follows another one need not be told of.
std::optional<replay::LiveJoint> lookAt(const LiveJoints& joints, const replay::RobotJoints& robot,
                                        const std::string& joint) {
  const auto live = joints.find(joint);
  const replay::MimicJoint* mimic = robot.mimicOf(joint);
  if (live || !mimic) return live;
  const auto other = joints.find(mimic->other);
  if (!other) return std::nullopt;
  return replay::LiveJoint{mimic->factor * other->position + mimic->offset,
                           mimic->factor * other->velocity};
}

/// Sends a goal and waits for its end; a goal that takes too long is canceled. Returns how it
/// failed; empty: it did not.
std::string perform(GuardedSink& sink, const replay::Channel& output, const replay::Bytes& goal,
                    const std::string& id, const std::function<bool()>& is_stopped) {
  sink.clock().watchThisThread();
  sink.goals().open(output.topic, id);
  sink.publish(output, goal);
  const RobotPatience patience(kLongestApproach);
  GoalOutcome outcome = GoalOutcome::Open;
  while (outcome == GoalOutcome::Open && !is_stopped() && !patience.isOver()) {
    std::this_thread::sleep_for(kGoalLook);
    sink.clock().beatIfDue();
    outcome = sink.goals().endOf(id).first;
  }
  if (outcome == GoalOutcome::Open) {
    sink.publish(cancelChannel(output), replay::cancelMessage(id));
    return "took too long";
  }
  return outcome == GoalOutcome::Succeeded ? "" : sink.goals().endOf(id).second;
}

}  // namespace

void BodyGate::addTo(replay::PlayReport& report) const {
  report.note(stops_->notes());
  report.note(notes_);
  report.guards = guards_;
  if (base_) base_->addTo(report);
}

std::vector<std::string> missingControllers(const replay::PlayPlan& plan,
                                            const replay::RobotProfile& robot,
                                            const RosGraph& graph) {
  const ControllerStates states = askControllers(graph);
  std::vector<std::string> missing;
  const auto look = [&](const std::string& topic) {
    const std::string why = whyNotRunning(states, topic);
    if (!why.empty() && !replay::contains(missing, why)) missing.push_back(why);
  };
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (!topic.movesBody() || topic.is_for_start) continue;
    const std::string& name = topic.output.topic;
    if (std::string why = whyUnwatched(graph, name); !why.empty())
      missing.push_back(std::move(why));
    look(name);
    if (isVelocity(topic.channel)) look(robot.base.output_topic);  // behind its multiplexer
    const bool is_heard = !graph.otherSubscribers(name).empty();
    const std::string action = replay::actionOf(name);
    if (isGoal(topic.channel)) {
      const bool is_served = is_heard && !graph.otherPublishers(action + "/status").empty();
      if (!is_served) missing.push_back("there is no action server " + action);
    } else if (!is_heard) {
      missing.push_back("nobody listens on " + name);
    }
    const replay::StopMaker stop(topic.output, stopOf(topic));
    const std::string& stop_topic = stop.channel().topic;
    const bool is_target = stop.stop().kind == replay::StopKind::Cancel && !isGoal(topic.channel);
    if (is_target && graph.otherSubscribers(stop_topic).empty()) {
      missing.push_back("nobody listens on " + stop_topic + ", which is to stop " + name);
    }
  }
  return missing;
}

bool movesBase(const replay::PlayPlan& plan, const replay::MovedParts& parts) {
  return parts.moves_base ||
         replay::anyOf(plan.topics, [](const auto& topic) { return topic.is_for_start; });
}

std::string whyUnnamed(const replay::MovedParts& parts, const BodyOptions& options) {
  if (parts.unnamed.empty() || options.start == BodyOptions::Start::Anywhere) return "";
  return fmt::format("what {} moves is not told by its messages and cannot be compared with how it "
                     "stood: --any-start (~any_start) moves it from anywhere",
                     fmt::join(parts.unnamed, ", "));
}

replay::StartPose startToCompare(const replay::Store& store, const replay::PlayPlan& plan,
                                 const BodyOptions& options, const replay::MovedParts& parts,
                                 const ReplayedBase* base, std::vector<std::string>& remarks) {
  if (options.start == BodyOptions::Start::Anywhere) return {};
  replay::StartPose then = readStartPose(store, plan, parts, remarks, options.base.frames);
  if (base && base->isOnOdometryAlone()) then.base.reset();
  return then;
}

replay::StartPose askStart(const BodyOptions& options, const replay::MovedParts& parts,
                           const replay::StartPose& then, const replay::TrackFrames& frames,
                           const std::function<bool()>& is_stopped) {
  std::set<std::string> wanted;
  const auto ask = [&](const std::string& joint) {
    if (!options.joints.mimicOf(joint)) wanted.insert(joint);
  };
  for (const std::string& joint : parts.joints()) ask(joint);
  for (const auto& [joint, position] : then.joints) ask(joint);
  if (wanted.empty() && !then.base) return {};
  LiveJoints joints(options.joint_topics);
  std::optional<BasePoses> base;
  if (then.base) base.emplace(frames);
  replay::StartPose now;
  const auto isKnown = [&] {
    const auto isTold = [&](const auto& joint) { return now.joints.count(joint) > 0; };
    return (!base || now.base) && replay::allOf(wanted, isTold);
  };
  // A simulation's seconds may be short, and connecting takes real ones.
  const RobotPatience patience(kLivePatience);
  const Deadline deadline = deadlineIn(kLivePatience);
  const auto isOver = [&] {
    return patience.isOver() && std::chrono::steady_clock::now() > deadline;
  };
  while (!isKnown() && !is_stopped() && !isOver()) {
    std::this_thread::sleep_for(kGoalLook);
    now.joints = joints.positions();
    const replay::BaseInput input = base ? base->look(stampNow()) : replay::BaseInput();
    if (input.T_map_odom && input.T_odom_base) {
      now.base = compose(input.T_map_odom->pose, input.T_odom_base->pose);
    }
  }
  return now;
}

std::string whyNoJoints(const BodyOptions& options, const replay::MovedParts& parts,
                        const replay::StartPose& now) {
  std::vector<std::string> unknown;
  for (const std::string& joint : parts.joints()) {
    const bool is_told = now.joints.count(joint) > 0 || options.joints.mimicOf(joint);
    if (!is_told) unknown.push_back(joint);
  }
  if (unknown.empty()) return "";
  return fmt::format("this robot has no joint {} ({})", replay::someOf(unknown),
                     replay::someOf(options.joint_topics));
}

replay::Approach readApproach(const replay::Store& store, const replay::PlayPlan& plan,
                              const BodyOptions& options) {
  const replay::Stamp from{plan.begin.ns - replay::kLongestRecordedWayNs};
  std::optional<replay::PoseTrack> base;
  if (options.start == BodyOptions::Start::MoveThere) {
    std::string why;
    base = readPoseTrack(store, replay::aroundMoments(plan.behavior, from, plan.end),
                         options.base.frames, options.base.noise, why);
  }
  return {replay::JointTrack::read(store, plan.behavior, from, plan.end), std::move(base),
          rulesOf(options)};
}

BodyGate::BodyGate(const replay::Store& store, const replay::PlayPlan& plan,
                   const BodyOptions& options, replay::MessageSink& sink, replay::Clock& clock,
                   std::function<void(const std::string&)> stop,
                   std::function<void(bool)> halt)
    : store_(store),
      plan_(plan),
      options_(options),
      stop_(std::move(stop)),
      take_over_(baseTopic(plan, options.base.topic, options.robot.base.velocity_topic),
                 options.robot.base, sink),
      sink_(plan, take_over_, clock, options.longest_stall_s, stop_),
      master_watch_([this](const std::string& reason) {
        stop_(reason);
        sink_.brake();
      }) {
  const auto stop_now = [this](const std::string& reason) {
    stop_(reason);  // first, as the watchdog then says that it was asked to
    sink_.brake();
  };
  stops_.emplace(options_.stops, take_over_, StopInputs::Actions{stop_now, std::move(halt)});
}

void BodyGate::check(const std::function<bool()>& is_stopped) {
  stops_->check();  // first: an emergency stop is why controllers are stopped
  const RosGraph graph = askMaster(deadlineIn(kMasterPatience));
  const auto missing = missingControllers(plan_, options_.robot, graph);
  refuseFor(fmt::format("{}", fmt::join(missing, "; ")));
  refuseFor(sink_.whyUnwatched(graph));
  parts_ = movedParts(store_, plan_, options_.joints);
  refuseFor(whyUnnamed(parts_, options_));
  if (movesBase(plan_, parts_)) {
    base_.emplace(store_, plan_, options_.base, options_.limits);
    refuseFor(base_->refusal(is_stopped));
    lookAhead(is_stopped);
  }
  if (parts_.moves_joints) listenToJoints(is_stopped);
  watchGripper();
  const replay::StartPose then =
      startToCompare(store_, plan_, options_, parts_, base_ ? &*base_ : nullptr, notes_);
  replay::StartPose now = live(then, is_stopped);
  if (is_stopped()) return;
  refuseFor(whyNoJoints(options_, parts_, now));
  if (joints_ || !parts_.goals.empty()) {
    approach_.emplace(readApproach(store_, plan_, options_));
  }
  checkWays(then, now);
  waitForGuards(is_stopped);
  const std::string why_not = goToStart(then, now, is_stopped);
  if (is_stopped()) return;
  refuseFor(why_not);
  stops_->waitUntilHeld(is_stopped);
  watchArm();
  holdGaze(is_stopped);
  if (base_) base_->prepare(is_stopped);
  const auto obstacles = base_ ? base_->obstacles() : std::nullopt;
  if (obstacles && base_->isPlayed() && !base_->drive()) {
    open_loop_.emplace(plan_, sink_, *obstacles, [this] { return base_->look(); }, stop_);
  }
}

replay::MessageSink& BodyGate::sink() {
  if (open_loop_) return *open_loop_;
  return sink_;
}

/// Nothing drives without something that sees who stands in the way.
void BodyGate::lookAhead(const std::function<bool()>& is_stopped) {
  const std::string why_not = base_->checkScan(is_stopped, [this](const std::string& reason) {
    const std::lock_guard<std::mutex> lock(waits_mutex_);
    waits_for_ = reason;
  });
  if (!why_not.empty() && base_->isPlayed()) throw replay::MotionRefused(why_not);
  why_no_drive_ = why_not;
}

std::string BodyGate::waitsFor() const {
  const std::lock_guard<std::mutex> lock(waits_mutex_);
  return waits_for_;
}

/// And says how long they wait, before anything moves.
void BodyGate::waitForGuards(const std::function<bool()>& is_stopped) {
  sink_.waitUntilReady(is_stopped);
  if (is_stopped()) return;
  guards_ = sink_.guards();
  for (const std::string& line : toText(*guards_)) ROS_INFO_STREAM(line);
  if (!guards_->on_robot) notes_.push_back(kNoRobotGuard);
}

void BodyGate::listenToJoints(const std::function<bool()>& is_stopped) {
  if (!options_.joints.isDescribed()) {
    notes_.push_back(
        "no robot_description was recorded, and there is none now: joints are taken to turn, or to "
        "slide, by their names, and none without an end");
  }
  joints_.emplace(options_.joint_topics);
  const RobotPatience patience(kLivePatience);
  while (joints_->positions().empty() && !is_stopped() && !patience.isOver()) {
    std::this_thread::sleep_for(kGoalLook);
  }
  joints_->watch([this] { return movingJoints(); },
                 [this](const std::string& reason) { stop_(reason); });
}

/// Returns the joints of the goals that are under way; a command of joints says nothing of its end.
std::vector<std::string> BodyGate::movingJoints() {
  std::vector<std::string> joints;
  for (const replay::JointGoals& motion : parts_.goals) {
    const bool moves =
        isGoal(motion.output) ? goals().isOpen(motion.output.topic) : sink_.hasMoved();
    if (moves) joints.insert(joints.end(), motion.joints.begin(), motion.joints.end());
  }
  return joints;
}

std::map<std::string, double> BodyGate::joints() const {
  std::map<std::string, double> fresh;
  if (!joints_) return fresh;
  for (const auto& [joint, position] : joints_->positions()) {
    if (const auto live = joints_->find(joint)) fresh[joint] = live->position;
  }
  return fresh;
}

/// A gripper is stopped where it is, if the robot's profile says which joints make its gap.
void BodyGate::watchGripper() {
  if (!joints_ || options_.robot.gripper_joints.empty()) return;
  sink_.watchGap([this]() -> std::optional<double> {
    double gap = 0;
    for (const std::string& joint : options_.robot.gripper_joints) {
      const auto live = joints_->find(joint);
      if (!live) return std::nullopt;
      gap += live->position;
    }
    return gap;
  });
}

/// Watches the arm from now on: goals begin where the joints are.
void BodyGate::watchArm() {
  if (!joints_) return;
  using Elsewhere = replay::ArmStartOptions::Elsewhere;
  replay::ArmStartOptions options;
  options.elsewhere = options_.start == BodyOptions::Start::MoveThere  ? Elsewhere::Approach
                      : options_.start == BodyOptions::Start::Anywhere ? Elsewhere::Accept
                                                                       : Elsewhere::Refuse;
  static_cast<replay::Approach::Rules&>(options) = rulesOf(options_);
  options.approach = &*approach_;
  options.controllers_join = options_.robot.controllers_join;
  arm_.emplace(
      approach_->recorded(),
      [this](const std::string& joint) { return lookAt(*joints_, options_.joints, joint); },
      options);
}

std::string BodyGate::gazeFrame() const {
  const std::string& frame = options_.robot.gaze_frame;
  return joints_ && !frame.empty() ? plan_.rewriting.frame(frame) : "";
}

void BodyGate::holdGaze(const std::function<bool()>& is_stopped) {
  const std::string gaze_frame = gazeFrame();
  const auto fresh_id = replay::uniqueGoalIds(ros::this_node::getName() + "_gaze");
  for (const replay::PlannedTopic& topic : plan_.topics) {
    if (gaze_frame.empty() || !topic.isPlayed() || !replay::isHeadGoal(topic.channel)) continue;
    const auto first =
        store_.messages(plan_.behavior, {{topic.channel.topic}, {}, plan_.end})->next();
    if (!first || is_stopped()) continue;
    const std::string id = fresh_id();
    const std::string why_not =
        perform(sink_, topic.output,
                replay::presentGaze(topic.channel, first->bytes, gaze_frame, id), id, is_stopped);
    if (why_not.empty() || is_stopped()) continue;
    notes_.push_back("the head did not hold its gaze before it was moved: a goal on " +
                     topic.output.topic + " " + why_not);
  }
}

/// Returns the base's deviation, after it was driven there, if that is asked for.
std::string BodyGate::baseDeviation(const replay::StartPose& then, const replay::StartPose& now,
                                    const std::function<bool()>& is_stopped) {
  if (!base_) return baseDeviationAtALook(then, now, options_.tolerances);
  std::string deviation = replay::baseDeviation(then, now, options_.tolerances);
  if (deviation.empty() || !now.base) return deviation;
  // Localization's noise alone may be that large.
  replay::StartPose mean;
  const auto look = [&] {
    mean.base = base_->measure(ReplayedBase::kMeanOf, is_stopped);
    const std::string off = replay::baseDeviation(then, mean, options_.tolerances);
    const replay::PoseError doubt = base_->startDoubt(then.base_share);
    const std::string sure = replay::baseDeviation(then, mean, widened(options_.tolerances, doubt));
    if (!off.empty() && sure.empty()) {
      notes_.push_back(
          fmt::format("{}: accepted, as localization knows it within {:.2f} m and {:.1f} deg", off,
                      doubt.position, doubt.yaw * replay::kDegreesPerRadian));
    }
    return sure;
  };
  deviation = look();
  if (deviation.empty() || options_.start != BodyOptions::Start::MoveThere || is_stopped()) {
    return deviation;
  }
  if (mean.base && distance(*mean.base, *then.base) > ReplayedBase::kFarthestStart) {
    return fmt::format("{}; --to-start drives at most {} m", deviation,
                       ReplayedBase::kFarthestStart);
  }
  if (!why_no_drive_.empty()) return deviation + "; " + why_no_drive_;
  const std::string failure = base_->driveTo(*then.base, sink_, is_stopped);
  if (!failure.empty()) return deviation + "; " + failure;
  notes_.push_back("the base was driven to the start");
  return look();
}

replay::StartPose BodyGate::live(const replay::StartPose& then,
                                 const std::function<bool()>& is_stopped) const {
  return askStart(options_, parts_, then, base_ ? base_->frames() : options_.base.frames,
                  is_stopped);
}

// ----------------------------------------------------------------------------------- to the start

/// Goes there if that is asked for, again and again while the button is released on the way.
/// Returns how far it is off then, and what helps.
std::string BodyGate::goToStart(const replay::StartPose& then, replay::StartPose now,
                                const std::function<bool()>& is_stopped) {
  const bool moves_there = options_.start == BodyOptions::Start::MoveThere;
  for (;;) {
    bool was_released = false;
    const std::function<bool()> is_halted = [&] {
      was_released = was_released || (moves_there && !stops_->isHeld());
      return was_released || is_stopped();
    };
    if (moves_there) stops_->waitUntilHeld(is_stopped);
    const std::string base = baseDeviation(then, now, is_halted);
    std::vector<std::string> deviations = jointDeviations(then, now, options_.tolerances);
    if (moves_there && base.empty() && !deviations.empty() && !is_halted()) {
      moveToStart(then, is_halted);
      now = live(then, is_halted);
      deviations = jointDeviations(then, now, options_.tolerances);
    }
    if (!was_released || is_stopped()) return replay::whyElsewhere(deviations, base, moves_there);
    now = live(then, is_stopped);
  }
}

/// Checks the ways before anything moves, the base, too; but MoveIt has to know the base at its
/// start.
void BodyGate::checkWays(const replay::StartPose& then, const replay::StartPose& now) const {
  const bool goes_there = options_.start == BodyOptions::Start::MoveThere &&
                          !jointDeviations(then, now, options_.tolerances).empty();
  if (!goes_there || StateValidity(options_.base.robot).isThere()) return;
  for (const replay::JointGoals& goals : parts_.goals) goalToStart(goals, then, now, "", {});
}

std::optional<replay::StartGoal> BodyGate::goalToStart(const replay::JointGoals& goals,
                                                       const replay::StartPose& then,
                                                       const replay::StartPose& now,
                                                       const std::string& id,
                                                       const replay::PoseCheck& check) const {
  try {
    return startGoal(goals, then, now, options_.tolerances, *approach_, plan_.begin, id, check);
  } catch (const replay::ApproachRefused& refusal) {
    throw replay::MotionRefused("to the start, " + std::string(refusal.what()));
  }
}

void BodyGate::moveToStart(const replay::StartPose& then,
                           const std::function<bool()>& is_stopped) {
  const auto fresh_id = replay::uniqueGoalIds(ros::this_node::getName() + "_start");
  StateValidity moveit(options_.base.robot);
  replay::PoseCheck check;
  if (moveit.isThere()) {
    check = [&](const auto& joints, const auto& pose) { return moveit.whyNot(joints, pose); };
  }
  for (const replay::JointGoals& goals : parts_.goals) {
    const std::string id = fresh_id();
    // Asked again for each: two controllers may share a joint.
    const replay::StartPose now = live(then, is_stopped);
    const auto goal = goalToStart(goals, then, now, id, check);
    if (!goal || is_stopped()) continue;
    notes_.push_back("the robot was moved to the start by " + goals.output.topic +
                     wayText(goal->kind));
    const std::string why_not = perform(sink_, goals.output, goal->bytes, id, is_stopped);
    if (why_not.empty() || is_stopped()) continue;
    refuseFor("it did not get to the start: a goal on " + goals.output.topic + " " + why_not);
  }
}

void BodyGate::onGoalStatus(const std::string& id, const replay::GoalEnd& end) {
  if (end.outcome() == GoalOutcome::Open) return;
  goals().finish(id, end.outcome(), sink_.clock().now(), end.words());
  sink_.goalEnded(id);
}

}  // namespace afterglow::nodes
