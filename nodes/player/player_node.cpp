#include "nodes/player/player_node.hpp"

#include <utility>

#include "replay/play/play_report.hpp"

namespace afterglow::nodes {
namespace {

ReplayResult resultOf(const replay::PlayPlan& plan, const replay::PlayReport& report) {
  ReplayResult result;
  result.completed = report.is_complete;
  result.behavior_id = plan.behavior.id;
  result.report = toJson(report).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return result;
}

}  // namespace

PlayerNodeOptions PlayerNodeOptions::read(const ros::NodeHandle& private_node) {
  PlayerNodeOptions options;
  private_node.param("store", options.store, options.store);
  private_node.param("allow_motion", options.allow_motion, options.allow_motion);
  private_node.param("wait_for_subscribers", options.wait_for_subscribers_s,
                     options.wait_for_subscribers_s);
  private_node.param("clear_projection", options.clear_projection, options.clear_projection);
  private_node.param("hold", options.hold_s, options.hold_s);
  private_node.param("goal_wait", options.goal_wait_s, options.goal_wait_s);
  return options;
}

PlayerNode::PlayerNode(const PlayerNodeOptions& options)
    : options_(options),
      server_(
          node_, "replay", [this](const ReplayGoalConstPtr& goal) { onGoal(goal); }, false) {
  status_ = private_node_.advertise<ReplayStatus>("status", 1, true);
  const auto serve = [this](const char* name, const char* done, auto action) {
    return private_node_.advertiseService<Trigger::Request, Trigger::Response>(
        name, [this, done, action](Trigger::Request&, Trigger::Response& response) {
          return command(response, done, action);
        });
  };
  stop_ = serve("stop", "stopped", [](ReplaySession& session) { session.stop("stopped"); });
  pause_ = serve("pause", "paused", [](ReplaySession& session) { session.pause(); });
  resume_ = serve("resume", "resumed", [](ReplaySession& session) { session.resume(); });
  timer_ = node_.createWallTimer(ros::WallDuration(0.05), [this](const auto&) { onTimer(); });
  publishStatus("");
  server_.start();
}

PlayerNode::~PlayerNode() {
  stop_.shutdown();
  pause_.shutdown();
  resume_.shutdown();
  timer_.stop();
  close("the player was shut down");
}

void PlayerNode::close(const std::string& reason) {
  std::unique_lock<std::mutex> lock(mutex_);
  is_closing_ = true;
  if (session_) {
    session_->stop(reason);
  }
  changed_.wait(lock, [this] { return !session_; });
}

// ---------------------------------------------------------------------------------------- the goal

ReplayRequest PlayerNode::requestOf(const ReplayGoal& goal) const {
  ReplayRequest request;
  request.behavior_id = goal.behavior_id;
  request.name = goal.name;
  request.only = goal.only;
  request.allow_motion = options_.allow_motion;
  request.wait_for_subscribers_s = options_.wait_for_subscribers_s;
  request.options.clear_projection = options_.clear_projection;
  request.options.hold_s = options_.hold_s;
  request.options.goal_wait_s = options_.goal_wait_s;
  return request;
}

void PlayerNode::onGoal(const ReplayGoalConstPtr& goal) {
  try {
    play(requestOf(*goal));
  } catch (const std::exception& error) {
    ROS_ERROR_STREAM("replay refused: " << error.what());
    show(nullptr, error.what());
    server_.setAborted({}, error.what());
  }
}

void PlayerNode::play(const ReplayRequest& request) {
  // Opened for each replay: what other processes recorded meanwhile, even into a new file, is
  // there.
  const auto store = replay::openStore(options_.store, replay::OpenMode::ReadOnly);
  const auto session = std::make_shared<ReplaySession>(*store, request);
  show(session, "");
  const replay::PlayReport report = session->run();
  const ReplayResult result = resultOf(session->plan(), report);
  show(nullptr, report.is_complete ? "completed" : report.reason);
  for (const std::string& note : report.notes) {
    ROS_WARN_STREAM("replay of behavior " << result.behavior_id << ": " << note);
  }
  if (report.is_complete) {
    server_.setSucceeded(result);
  } else if (server_.isPreemptRequested()) {
    server_.setPreempted(result, report.reason);
  } else {
    server_.setAborted(result, report.reason);
  }
}

void PlayerNode::show(std::shared_ptr<ReplaySession> session, const std::string& message) {
  const std::lock_guard<std::mutex> lock(status_mutex_);
  setSession(std::move(session));
  publishStatus(message);
}

void PlayerNode::setSession(std::shared_ptr<ReplaySession> session) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    session_ = std::move(session);
    if (session_ && is_closing_) {
      session_->stop("the player was shut down");
    }
  }
  changed_.notify_all();
}

// ------------------------------------------------------------------------------------ from outside

void PlayerNode::onTimer() {
  std::shared_ptr<ReplaySession> session;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    session = session_;
  }
  if (!session) {
    return;
  }
  if (server_.isPreemptRequested()) {
    session->stop("canceled");
  }
  const replay::PlayProgress progress = session->progress();
  if (progress.state != replay::PlayProgress::State::Idle) {
    ReplayFeedback feedback;
    feedback.position = progress.position.seconds();
    feedback.duration = replay::PlaybackTime{session->plan().durationNs()}.seconds();
    feedback.published = progress.published;
    server_.publishFeedback(feedback);
  }
  const std::lock_guard<std::mutex> lock(status_mutex_);
  if (status().state != shown_state_) {
    publishStatus("");  // paused, or going on
  }
}

bool PlayerNode::command(Trigger::Response& response, const char* done,
                         const std::function<void(ReplaySession&)>& command) {
  const std::lock_guard<std::mutex> lock(mutex_);
  response.success = session_ != nullptr;
  response.message = session_ ? done : "nothing is being replayed";
  if (session_) {
    command(*session_);
  }
  return true;
}

ReplayStatus PlayerNode::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  ReplayStatus status;
  status.rate = 1.0;
  if (session_) {
    const replay::PlayPlan& plan = session_->plan();
    const replay::PlayProgress progress = session_->progress();
    status.state = progress.state == replay::PlayProgress::State::Paused ? ReplayStatus::PAUSED
                                                                         : ReplayStatus::PLAYING;
    status.behavior_id = plan.behavior.id;
    status.behavior_name = plan.behavior.name;
    status.position = progress.position.seconds();
    status.duration = replay::PlaybackTime{plan.durationNs()}.seconds();
  }
  return status;
}

void PlayerNode::publishStatus(const std::string& message) {
  ReplayStatus now = status();
  now.message = message;
  shown_state_ = now.state;
  status_.publish(now);
}

}  // namespace afterglow::nodes
