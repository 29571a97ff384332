#include "nodes/player/replay_session.hpp"

#include <chrono>
#include <stdexcept>
#include <thread>
#include <utility>

#include "nodes/player/end_pose.hpp"
#include "nodes/player/realtime.hpp"
#include "nodes/player/ros_clock.hpp"
#include "nodes/player/stagehand.hpp"
#include "nodes/player/stop_signal.hpp"
#include "replay/query/behavior_selector.hpp"

namespace afterglow::nodes {
namespace {

/// What a body is played at.
constexpr double kSlowest = 0.1, kFastest = 10;
constexpr double kFastestClock = 1000;

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    text += (text.empty() ? "" : ", ") + name;
  }
  return text;
}

replay::PlayPlan planned(const replay::Store& store, const ReplayRequest& request) {
  const replay::Behavior behavior = findRequested(store, request);
  const std::string called = "behavior " + std::to_string(behavior.id) + " '" + behavior.name + "'";
  replay::PlanOptions options = request.plan;
  options.only = replay::parseModalities(request.only);
  options.has_recorded_time = request.clock == ReplayClock::Sim;
  replay::PlayPlan plan = makePlan(store, behavior, options);
  if (plan.playedTopics().empty()) {
    throw std::runtime_error(called + ": there is nothing to play" +
                             (request.only.empty() ? "" : " of " + request.only));
  }
  const std::string first = plan.playedTopics().front();
  Stagehand::fit(store, plan, request.anchors);
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (plan.playedTopics().empty() && topic.channel.topic == first) {
      throw std::runtime_error(called + ", " + first + ": " + topic.why_not);
    }
  }
  const std::vector<std::string> motion = plan.motionTopics();
  const bool is_fit_for_body = !request.options.is_looping && !request.options.is_immediate;
  if (!motion.empty() && !is_fit_for_body) {
    throw std::runtime_error(called + " moves the robot (" + joined(motion) +
                             "): loops and haste are for light and speech only (ar,speech)");
  }
  if (!motion.empty() && !request.rate_control.topic.empty()) {
    throw std::runtime_error(called + " moves the robot (" + joined(motion) +
                             "): only light and speech (ar,speech) wait for " +
                             request.rate_control.topic);
  }
  return plan;
}

std::vector<replay::MotionPeak> peaksOf(const replay::Store& store, const replay::PlayPlan& plan,
                                        const ReplayRequest& request) {
  const bool is_needed = request.limits.is_strict || !plan.motionTopics().empty();
  return is_needed ? motionPeaks(store, plan, request.limits) : std::vector<replay::MotionPeak>{};
}

}  // namespace

replay::Behavior findRequested(const replay::Store& store, const ReplayRequest& request) {
  if (request.behavior_id != 0) {
    if (const auto behavior = store.behavior(request.behavior_id)) {
      return *behavior;
    }
    throw std::runtime_error("there is no behavior " + std::to_string(request.behavior_id));
  }
  if (request.name.empty() && !request.selector.empty()) {
    return replay::selectBehavior(store, request.selector);
  }
  if (request.name.empty()) {
    throw std::runtime_error("no behavior is named: give its id or its name");
  }
  replay::BehaviorFilter filter;
  filter.name = request.name;
  const std::vector<replay::Behavior> found = store.behaviors(filter);
  if (found.empty()) {
    throw std::runtime_error("there is no behavior called '" + request.name + "'");
  }
  return found.front();
}

ReplaySession::ReplaySession(const replay::Store& store, const ReplayRequest& request)
    : store_(store),
      request_(request),
      plan_(planned(store, request)),
      peaks_(peaksOf(store, plan_, request)),
      is_paused_(request.options.starts_paused) {
  request_.options.has_recorded_time = request.clock == ReplayClock::Sim;
  request_.body.base.has_recorded_time = request.clock == ReplayClock::Sim;
  checkRate(request.options.rate);
  if (!(request.clock_hz > 0 && request.clock_hz <= kFastestClock)) {
    throw std::runtime_error("/clock is given at rates above 0 and up to 1000 Hz");
  }
  if (!(request.rate_control.longest_delay_s >= 0)) {
    throw std::runtime_error("a longest delay of the rate control has to be 0 s or more");
  }
}

ReplaySession::~ReplaySession() = default;

void ReplaySession::checkRate(double rate) const {
  if (plan_.motionTopics().empty()) {
    return;
  }
  if (!(rate >= kSlowest && rate <= kFastest)) {
    throw std::runtime_error("a body is played at rates from 0.1 to 10");
  }
  const std::string reason = whyTooFast(peaks_, rate);
  if (!reason.empty()) {
    throw std::runtime_error(reason);
  }
}

void ReplaySession::checkMotionAllowed() const {
  const std::vector<std::string> motion = plan_.motionTopics();
  if (!motion.empty() && !request_.allow_motion) {
    throw std::runtime_error(
        "motion is not allowed here (~allow_motion, --allow-motion), and this "
        "behavior moves the robot by " +
        joined(motion) + "; ar,speech can be played without");
  }
}

replay::PlayPlan ReplaySession::countedPlan() const {
  replay::PlayPlan plan = plan_;
  replay::Rewriter rewriter(replay::uniqueGoalIds("dry_run"), plan.rewriting);
  const auto cursor = store_.messages(plan.behavior, {plan.playedTopics(), plan.begin, plan.end});
  // Any other time: what is to be shifted is shifted.
  const std::int64_t shift = request_.clock == ReplayClock::Sim ? 0 : 1'000'000'000;
  while (auto message = cursor->next()) {
    const replay::Stamp now{message->received.ns + shift};
    try {
      (void)rewriter.rewrite(store_.channel(message->channel), {now, shift}, message->bytes);
    } catch (const replay::MessageError&) {  // refused when it is played, too
    }
  }
  for (replay::PlannedTopic& topic : plan.topics) {
    if (topic.isPlayed()) topic.rewrites = rewriter.rules(topic.channel);
  }
  return plan;
}

// ---------------------------------------------------------------------------------------- playing

replay::PlayReport ReplaySession::run() {
  checkMotionAllowed();
  const std::string clock_giver = clockPublisher();
  if (request_.clock == ReplayClock::Sim && !clock_giver.empty()) {
    throw std::runtime_error(clock_giver + " publishes /clock, too: two clocks are refused");
  }
  const bool follows = request_.clock == ReplayClock::Follow ||
                       (request_.clock == ReplayClock::Live && ros::Time::isSimTime());
  if (follows) {
    followed_ = std::make_unique<replay::FollowedClock>();
  } else {
    own_clock_ = std::make_unique<replay::SteadyClock>();
  }
  std::optional<ClockFollower> follower;
  if (followed_) follower.emplace(*followed_);
  std::optional<ClockGiver> giver;
  if (request_.clock == ReplayClock::Sim) {
    giver.emplace(request_.clock_hz, [this, last = plan_.begin]() mutable {
      const replay::PlayProgress now = progress();
      if (now.state != replay::PlayProgress::State::Idle) {
        last = {plan_.behavior.begin.ns + now.position.ns};
      }
      return last;
    });
  }
  RosSink sink(plan_, request_.queue,
               {[this](const std::string& goal, std::uint8_t status) {
                  const std::lock_guard<std::mutex> lock(mutex_);
                  if (gate_) gate_->onGoalStatus(goal, status);
                  if (player_) player_->onGoalStatus(goal, status);
                },
                [this](const std::string& driver) { stop(driver); }});
  const std::vector<std::string> unheard = sink.waitForSubscribers(
      deadlineIn(request_.wait_for_subscribers_s), [this] { return isStopped(); });
  if (request_.needs_subscribers && !unheard.empty() && !isStopped()) {
    throw std::runtime_error("nobody listens on " + joined(unheard) +
                             ": an unheard replay was to abort");
  }
  sink.listenForDrivers();
  replay::PlayReport report = play(sink);
  letMessagesLeave();  // what is still queued is lost with its publisher: the zero velocity, too
  for (const std::string& topic : unheard) {
    report.notes.push_back("nobody listened on " + topic + " at the start");
  }
  return report;
}

replay::PlayReport ReplaySession::play(RosSink& sink) {
  waitBeforeStart();
  std::optional<RealtimeScope> realtime;
  if (request_.is_realtime) realtime.emplace();
  replay::Clock& clock = followed_ ? static_cast<replay::Clock&>(*followed_) : *own_clock_;
  if (!plan_.motionTopics().empty()) openGate(sink, clock);
  std::optional<RateControl> rate_control;
  if (!request_.rate_control.topic.empty()) {
    rate_control.emplace(request_.rate_control, plan_, request_.clock == ReplayClock::Sim, sink,
                         asSeenByConsumer());
  }
  replay::MessageSink& outlet = rate_control ? *rate_control
                                : gate_      ? gate_->sink()
                                             : static_cast<replay::MessageSink&>(sink);
  Stagehand stagehand(store_, plan_, request_.anchors, outlet, [this] { return moment(); });
  stagehand.prepare([this] { return isStopped(); });
  replay::PlayOptions options = request_.options;
  options.anchor = stagehand.anchor();
  options.base_drive = gate_ ? gate_->baseDrive() : nullptr;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    player_ = std::make_unique<replay::Player>(
        store_, plan_, options, stagehand.sink(), gate_ ? gate_->clock() : clock,
        [this] { return now(); }, replay::uniqueGoalIds(ros::this_node::getName()));
    is_paused_ ? player_->pause() : player_->resume();
    if (stop_reason_) player_->stop(*stop_reason_);
  }
  stagehand.listen([this](const std::string& problem) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (player_) player_->fail(replay::Modality::Speech, problem);
  });
  replay::PlayReport report = player_->run();
  report.scheduling = realtime ? realtime->description() : "normal";
  const std::vector<std::string> notes = stagehand.notes();
  report.notes.insert(report.notes.end(), notes.begin(), notes.end());
  if (gate_) {
    gate_->addTo(report);
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    player_.reset();
  }
  closeGate();
  if (report.is_complete && !plan_.motionTopics().empty()) addEnd(report);
  return report;
}

void ReplaySession::addEnd(replay::PlayReport& report) const {
  try {
    report.body_end = measureEnd(store_, plan_, report, request_.body.base.frames,
                                 [this] { return isStopped(); });
  } catch (const std::exception& error) {
    report.notes.push_back(std::string("how the robot ended was not measured: ") + error.what());
  }
}

void ReplaySession::openGate(RosSink& sink, replay::Clock& clock) {
  auto gate = std::make_unique<BodyGate>(store_, plan_, request_.body, request_.limits, sink, clock,
                                         [this](const std::string& reason) { stop(reason); });
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    gate_ = std::move(gate);
  }
  try {
    gate_->check([this] { return isStopped(); });
  } catch (...) {
    closeGate();
    throw;
  }
}

/// Takes as long as the watchdog takes to end.
void ReplaySession::closeGate() {
  std::unique_ptr<BodyGate> gate;
  const std::lock_guard<std::mutex> lock(mutex_);
  gate = std::move(gate_);
}

/// For the first tick of a clock that is followed, and as long as was asked for.
void ReplaySession::waitBeforeStart() {
  const Deadline start = deadlineIn(request_.delay_s);
  const auto waits = [&] {
    return (followed_ && !followed_->hasTicked()) || std::chrono::steady_clock::now() < start;
  };
  while (waits() && !isStopped() && ros::ok()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

std::optional<AnchorBroadcast::Moment> ReplaySession::moment() const {
  const replay::PlayProgress at = progress();
  if (at.state == replay::PlayProgress::State::Idle) return std::nullopt;
  const replay::Stamp recorded{plan_.behavior.begin.ns + at.position.ns};
  return AnchorBroadcast::Moment{recorded, request_.clock == ReplayClock::Sim ? recorded : now()};
}

RateControl::Replay ReplaySession::asSeenByConsumer() {
  const auto position = [this] {
    return replay::Stamp{plan_.behavior.begin.ns + progress().position.ns};
  };
  const auto hold = [this](bool holds) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (player_) player_->hold(holds);
  };
  return {position, [this] { return now(); }, hold,
          [this](const std::string& reason) { stop(reason); }};
}

replay::Stamp ReplaySession::now() const {
  return followed_ ? followed_->time()
                   : replay::Stamp{static_cast<std::int64_t>(ros::Time::now().toNSec())};
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

void ReplaySession::pause() {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_paused_ = true;
  if (player_) player_->pause();
}

void ReplaySession::resume() {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_paused_ = false;
  if (player_) player_->resume();
}

bool ReplaySession::isPaused() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return player_ ? player_->isPauseWanted() : is_paused_;
}

/// With the lock held.
replay::Player& ReplaySession::player() const {
  if (!player_) throw std::runtime_error("it does not play yet");
  return *player_;
}

void ReplaySession::setRate(double rate) {
  checkRate(rate);
  const std::lock_guard<std::mutex> lock(mutex_);
  player().setRate(rate);
}

void ReplaySession::seek(double seconds) {
  const std::lock_guard<std::mutex> lock(mutex_);
  player().seek({static_cast<std::int64_t>(seconds * 1e9)});
}

void ReplaySession::playNext(std::uint64_t count) {
  const std::lock_guard<std::mutex> lock(mutex_);
  player().playNext(count);
}

bool ReplaySession::togglePauseTopics() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return player().togglePauseTopics();
}

replay::PlayProgress ReplaySession::progress() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return player_ ? player_->progress() : replay::PlayProgress{};
}

}  // namespace afterglow::nodes
