#include "nodes/player/replay_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <utility>

#include "nodes/player/live_graph.hpp"
#include "nodes/player/media_sink.hpp"
#include "nodes/player/realtime.hpp"
#include "nodes/player/robot_description.hpp"
#include "nodes/player/robot_file.hpp"
#include "nodes/player/ros_clock.hpp"
#include "nodes/tools/stop_signal.hpp"
#include "replay/record/snapshot.hpp"

namespace afterglow::nodes {
namespace {

/// The rates at which a body is played.
constexpr double kSlowest = 0.1, kFastest = 10;

/// Describes the robot by its description and profile, as far as that needs no master.
void describeRobot(const replay::Store& store, const replay::PlayPlan& plan,
                   ReplayRequest& request) {
  BodyOptions& body = request.body;
  body.joints = recordedJoints(store, plan.behavior, body.robot);
  body.joint_topics.clear();
  for (const std::string& topic :
       recordedTopics(store, plan.behavior, {"sensor_msgs/JointState"}, "/joint_states")) {
    body.joint_topics.push_back(liveName(plan, request.plan, topic));
  }
  const std::vector<std::string> transforms =
      recordedTopics(store, plan.behavior, {"tf2_msgs/TFMessage", "tf/tfMessage"}, "/tf");
  // A robot in a namespace of its own may have its transforms there; else they are everybody's.
  if (transforms.size() == 1 && transforms.front() != "/tf") {
    body.base.frames.topic = transforms.front();
    body.base.tf_topic = liveName(plan, request.plan, transforms.front());
  }
  body.limits = boundedBy(body.limits, body.joints, body.robot);
}

/// The same by today's description if none was recorded: true if its limits are known better then.
/// Without a profile, a robot that one is known of by its description's name has its gaze kept,
/// too: without that its head jumps.
bool describeRobotNow(ReplayRequest& request) {
  BodyOptions& body = request.body;
  const bool is_new = !body.joints.isDescribed();
  if (is_new) {
    body.joints = liveDescription(body.base.robot.name_space, body.robot);
    body.limits = boundedBy(body.limits, body.joints, body.robot);
  }
  const auto known = body.robot.name.empty() ? builtInRobot(body.joints.robotName()) : std::nullopt;
  const replay::RobotNames& recorded = request.plan.rewriting.robot.recorded;
  if (known) body.robot.gaze_frame = recorded.frame(known->gaze_frame);
  return is_new && body.joints.isDescribed();
}

/// Returns true if the base's poses, or light that is anchored there, need the map.
bool isPlacedOnMap(const replay::PlayPlan& plan, const ReplayRequest& request) {
  const replay::AnchorSettings anchors = MediaPreparation::anchorsIn(plan, request.anchors);
  const bool is_lit_there = anchors.frame == request.body.base.frames.map;
  const bool is_driven_there = !request.body.base.is_open_loop;
  return std::any_of(plan.topics.begin(), plan.topics.end(), [&](const auto& topic) {
    if (!topic.isPlayed() || topic.count == 0) return false;
    return (is_lit_there && anchors.of(topic.channel) == replay::Anchor::World) ||
           (is_driven_there && isVelocity(topic.channel));
  });
}

}  // namespace

ReplaySession::ReplaySession(const replay::Store& store, const ReplayRequest& request)
    : store_(store),
      request_(forItsRobot(store, request)),
      plan_(planReplay(store, request_)),
      is_paused_(request.options.starts_paused),
      is_halted_(!request.body.stops.hold_button.topic.empty() && !plan_.motionTopics().empty()) {
  request_.options.has_recorded_time = request.clock == ReplayClock::Sim;
  request_.body.base.has_recorded_time = request.clock == ReplayClock::Sim;
  request_.body.base.rate = request.options.rate;
  if (plan_.motionTopics().empty()) return;
  describeRobot(store, plan_, request_);
  passGate(request.options.rate);
}

/// Once more when the robot is known better.
void ReplaySession::passGate(double rate) {
  std::vector<replay::MotionPeak> peaks =
      motionPeaks(store_, plan_, request_.body.limits, request_.body.joints,
                  !request_.body.base.is_open_loop);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    peaks_ = std::move(peaks);
  }
  checkRate(rate);
}

void ReplaySession::checkRate(double rate) const {
  if (plan_.motionTopics().empty()) {
    return;
  }
  if (!(rate >= kSlowest && rate <= kFastest)) {
    throw std::runtime_error("a body is played at rates from 0.1 to 10");
  }
  const bool is_as_recorded = rate == 1 && !request_.body.limits.are_given;
  const std::string only = is_as_recorded ? "" : whyOnlyAsRecorded(plan_);
  const std::string why = only.empty() ? whyTooFast(peaks(), rate) : only;
  if (!why.empty()) throw std::runtime_error(why);
}

std::vector<replay::MotionPeak> ReplaySession::peaks() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return peaks_;
}

void ReplaySession::checkPlayable() const {
  const std::string refusal = plan_.refusal();
  if (!refusal.empty()) throw std::runtime_error(refusal);
  checkSomethingToPlay(plan_, request_);
}

// ---------------------------------------------------------------------------------------- playing

void ReplaySession::refuseOtherMap() const {
  if (request_.body.is_any_map_right || !isPlacedOnMap(plan_, request_)) return;
  const std::string why = whyOtherMap(plan_.behavior, "/map", [this] { return isStopped(); });
  if (!why.empty()) {
    throw std::runtime_error(why + ": base and light would be anywhere (--any-map, ~any_map)");
  }
}

Rehearsal ReplaySession::rehearse(bool has_master, const std::function<bool()>& is_stopped) {
  Rehearsal rehearsal;
  rehearsal.ask([this] { checkPlayable(); });
  if (plan_.playedTopics().empty()) return rehearsal;
  if (has_master) {
    rehearsal.ask([&] {
      refuseLiveRobot(request_, deadlineIn(kMasterPatience));
      refuseLivePublishers(plan_, is_stopped);
    });
    rehearsal.ask([this] { refuseOtherMap(); });
  } else {
    rehearsal.unchecked.push_back("who publishes the same");
    if (request_.place() == replay::ReplayPlace::Elsewhere) {
      rehearsal.unchecked.push_back("whether a robot is live there");
    }
    const bool needs_map = !request_.body.is_any_map_right && isPlacedOnMap(plan_, request_) &&
                           !replay::recordedMap(plan_.behavior).empty();
    if (needs_map) rehearsal.unchecked.push_back("whether the map is the recorded one");
  }
  if (plan_.motionTopics().empty()) return rehearsal;
  if (has_master && describeRobotNow(request_)) {
    rehearsal.ask([this] { passGate(request_.options.rate); });
  }
  rehearseBody(store_, plan_, request_.body, has_master, is_stopped, rehearsal);
  return rehearsal;
}

replay::PlayReport ReplaySession::run() {
  checkPlayable();
  for (const std::string& warning : plan_.warnings()) ROS_WARN_STREAM(warning);
  refuseLiveRobot(request_, deadlineIn(kMasterPatience));
  refuseLivePublishers(plan_, [this] { return isStopped(); });
  refuseOtherMap();
  time_ = std::make_unique<ReplayTime>(request_.clock, [this](double seconds) {
    // Messages that are due meanwhile would be sent at once.
    if (plan_.motionTopics().empty()) return;
    stop(fmt::format("the clock that is followed jumped by {:.1f} s", seconds));
  });
  std::optional<ClockGiver> giver;
  if (request_.clock == ReplayClock::Sim) {
    giver.emplace(request_.clock_hz, [this, last = plan_.begin]() mutable {
      return last = position().value_or(last);
    });
  }
  RosSink sink(plan_, request_.queue,
               {[this](const std::string& goal, const replay::GoalEnd& end) {
                  const std::lock_guard<std::mutex> lock(mutex_);
                  if (player_) player_->onGoalStatus(goal, end);
                  if (gate_) gate_->onGoalStatus(goal, end);
                },
                [this](const std::string& driver) { stop(driver); }});
  const std::vector<std::string> unheard = sink.waitForSubscribers(
      deadlineIn(request_.wait_for_subscribers_s), [this] { return isStopped(); });
  if (request_.needs_subscribers && !unheard.empty() && !isStopped()) {
    throw std::runtime_error(fmt::format(
        "nobody listens on {}: an unheard replay was to abort", fmt::join(unheard, ", ")));
  }
  sink.listenForDrivers();
  replay::PlayReport report = play(sink);
  letMessagesLeave();  // what is still queued is lost with its publisher: the zero velocity, too
  report.note(replay::unheardNotes(unheard, report));
  report.note(plan_.warnings());
  report.note({time_->note(), plan_.leftOutText()});
  return report;
}

replay::PlayReport ReplaySession::play(RosSink& sink) {
  waitBeforeStart();
  std::optional<RealtimeScope> realtime;
  if (request_.is_realtime) realtime.emplace();
  replay::Clock& clock = time_->clock();
  const auto scheduleNewThreads = [&] {
    if (realtime) realtime->extend();
  };
  const GateKeeper keeper{*this};
  if (!plan_.motionTopics().empty()) openGate(sink, clock, scheduleNewThreads);
  std::optional<RateControl> rate_control;
  if (!request_.rate_control.topic.empty()) {
    rate_control.emplace(request_.rate_control, plan_, request_.clock == ReplayClock::Sim, sink,
                         asSeenByConsumer());
  }
  replay::MessageSink& outlet = rate_control ? *rate_control
                                : gate_      ? gate_->sink()
                                             : static_cast<replay::MessageSink&>(sink);
  MediaPreparation preparation(store_, plan_, request_.anchors, outlet,
                               [this] { return moment(); });
  reportOnceMoved([&] { preparation.prepare([this] { return isStopped(); }); });
  replay::PlayOptions options = request_.options;
  options.anchor = preparation.anchor();
  if (gate_) {
    options.base_drive = gate_->baseDrive();
    options.arm_start = gate_->armStart();
    options.gaze_frame = gate_->gazeFrame();
    options.goals = &gate_->goals();
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    player_ = std::make_unique<replay::Player>(
        store_, plan_, options, preparation.sink(), gate_ ? gate_->clock() : clock,
        [this] { return time_->now(); }, replay::uniqueGoalIds(ros::this_node::getName()));
    is_paused_ ? player_->pause() : player_->resume();
    player_->halt(is_halted_);
    if (stop_reason_) player_->stop(*stop_reason_);
  }
  preparation.listen([this](const std::string& problem) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (player_) player_->fail(replay::Modality::Speech, problem);
  });
  scheduleNewThreads();
  replay::PlayReport report = player_->run();
  report.scheduling = realtime ? realtime->description() : "normal";
  report.note(preparation.notes());
  if (gate_) gate_->addTo(report);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ended_ = player_->progress();
    ended_->state = replay::PlayProgress::State::Idle;
    player_.reset();
    // A goal that an emergency stop has ended may be heard of before the stop itself.
    if (!report.is_complete && stop_reason_ && *stop_reason_ != report.reason) {
      report.reason += "; " + *stop_reason_;
    }
  }
  std::map<std::string, double> joints;
  if (gate_) joints = gate_->joints();
  closeGate();
  if (report.is_complete && !plan_.motionTopics().empty()) {
    addEnd(
        store_, plan_, request_.body, joints, [this] { return isStopped(); }, report);
  }
  return report;
}

void ReplaySession::openGate(RosSink& sink, replay::Clock& clock,
                             const std::function<void()>& on_threads_begun) {
  if (describeRobotNow(request_)) passGate(request_.options.rate);
  BodyOptions options = request_.body;
  // Where nothing waits for the base, it cannot wait either.
  if (!request_.options.is_in_step) options.base.scan.obstacles.patience = 0;
  const auto halt = [this](bool halts) {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_halted_ = halts;
    if (player_) player_->halt(halts);
  };
  auto gate = std::make_unique<BodyGate>(
      store_, plan_, options, sink, clock, [this](const std::string& reason) { stop(reason); },
      halt);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    gate_ = std::move(gate);
  }
  on_threads_begun();  // one has the watchdog hear that the player lives
  reportOnceMoved([&] { gate_->check([this] { return isStopped(); }); });
}

/// Prepares a replay; a failure once the robot was moved is no refusal any more: the replay is
/// stopped, and reported.
void ReplaySession::reportOnceMoved(const std::function<void()>& prepare) {
  try {
    prepare();
  } catch (const std::exception& error) {
    if (!gate_ || !gate_->hasMoved()) throw;
    stop(error.what());
  }
}

/// Takes as long as the watchdog takes to end.
void ReplaySession::closeGate() {
  std::unique_ptr<BodyGate> gate;
  const std::lock_guard<std::mutex> lock(mutex_);
  gate = std::move(gate_);
}

/// Waits for the first tick of a clock that is followed, and as long as was asked for.
void ReplaySession::waitBeforeStart() {
  const Deadline start = deadlineIn(request_.delay_s);
  const auto waits = [&] { return !time_->hasBegun() || std::chrono::steady_clock::now() < start; };
  while (waits() && !isStopped() && ros::ok()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

/// The recorded moment that is played; empty while nothing is.
std::optional<replay::Stamp> ReplaySession::position() const {
  const replay::PlayProgress at = progress();
  const replay::Stamp recorded{plan_.behavior.begin.ns + at.position.ns};
  const bool is_idle = at.state == replay::PlayProgress::State::Idle;
  return is_idle ? std::nullopt : std::optional(recorded);
}

std::optional<AnchorBroadcast::Moment> ReplaySession::moment() const {
  const std::optional<replay::Stamp> at = position();
  if (!at) return std::nullopt;
  return AnchorBroadcast::Moment{*at, request_.clock == ReplayClock::Sim ? *at : time_->now()};
}

RateControl::Replay ReplaySession::asSeenByConsumer() {
  const auto at = [this] { return position().value_or(plan_.behavior.begin); };
  const auto hold = [this](bool holds) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (player_) player_->hold(holds);
  };
  return {at, [this] { return time_->now(); }, hold,
          [this](const std::string& reason) { stop(reason); }};
}

// --------------------------------------------------------------------------------------- commands

bool ReplaySession::isStopped() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return stop_reason_.has_value();
}

void ReplaySession::stop(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!stop_reason_) stop_reason_ = reason;
  if (player_) player_->stop(reason);
}

void ReplaySession::pause(bool pauses) {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_paused_ = pauses;
  if (player_) pauses ? player_->pause() : player_->resume();
}

bool ReplaySession::isPaused() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return player_ ? player_->isPauseWanted() : is_paused_;
}

void ReplaySession::setRate(double rate) {
  checkRate(rate);
  tell([&](replay::Player& player) { player.setRate(rate); });
}

replay::PlayProgress ReplaySession::progress() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return player_ ? player_->progress() : ended_.value_or(replay::PlayProgress{});
}

bool ReplaySession::goesToStart() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return gate_ && !ended_ && request_.body.start == BodyOptions::Start::MoveThere;
}

std::string ReplaySession::waitsFor() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return gate_ ? gate_->waitsFor() : "";
}

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
