#include "nodes/player/replay_session.hpp"

#include <stdexcept>
#include <utility>

#include "nodes/player/stop_signal.hpp"

namespace afterglow::nodes {
namespace {

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
  replay::PlayPlan plan = makePlan(store, behavior, replay::parseModalities(request.only));
  if (plan.playedTopics().empty()) {
    throw std::runtime_error(called + ": there is nothing to play" +
                             (request.only.empty() ? "" : " of " + request.only));
  }
  const std::vector<std::string> motion = plan.motionTopics();
  if (!motion.empty() && request.options.rate != 1.0) {
    throw std::runtime_error(called + " moves the robot (" + joined(motion) +
                             "): another rate than 1 is for light and speech only (ar,speech)");
  }
  return plan;
}

}  // namespace

replay::Behavior findRequested(const replay::Store& store, const ReplayRequest& request) {
  if (request.behavior_id != 0) {
    if (const auto behavior = store.behavior(request.behavior_id)) {
      return *behavior;
    }
    throw std::runtime_error("there is no behavior " + std::to_string(request.behavior_id));
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
    : store_(store), request_(request), plan_(planned(store, request)) {}

void ReplaySession::checkMotionAllowed() const {
  const std::vector<std::string> motion = plan_.motionTopics();
  if (!motion.empty() && !request_.allow_motion) {
    throw std::runtime_error(
        "motion is not allowed here (~allow_motion, --allow-motion), and this "
        "behavior moves the robot by " +
        joined(motion) + "; ar,speech can be played without");
  }
}

replay::PlayReport ReplaySession::run() {
  checkMotionAllowed();
  askMaster(deadlineIn(kMasterPatience));
  RosSink sink(plan_, {[this](const std::string& goal, std::uint8_t status) {
                         const std::lock_guard<std::mutex> lock(mutex_);
                         if (player_) player_->onGoalStatus(goal, status);
                       },
                       [this](const std::string& driver) { stop(driver); }});
  const std::vector<std::string> unheard = sink.waitForSubscribers(
      deadlineIn(request_.wait_for_subscribers_s), [this] { return isStopped(); });
  sink.listenForDrivers();
  replay::PlayReport report = play(sink);
  letMessagesLeave();  // what is still queued is lost with its publisher: the zero velocity, too
  for (const std::string& topic : unheard) {
    report.notes.push_back("nobody listened on " + topic + " at the start");
  }
  return report;
}

replay::PlayReport ReplaySession::play(RosSink& sink) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    player_ = std::make_unique<replay::Player>(
        store_, plan_, request_.options, sink, clock_,
        [] { return replay::Stamp{static_cast<std::int64_t>(ros::Time::now().toNSec())}; },
        replay::uniqueGoalIds(ros::this_node::getName()));
    if (is_paused_) player_->pause();
    if (stop_reason_) player_->stop(*stop_reason_);
  }
  replay::PlayReport report = player_->run();
  const std::lock_guard<std::mutex> lock(mutex_);
  player_.reset();
  return report;
}

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

replay::PlayProgress ReplaySession::progress() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return player_ ? player_->progress() : replay::PlayProgress{};
}

}  // namespace afterglow::nodes
