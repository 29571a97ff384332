#include "nodes/player/player_node.hpp"

#include <optional>
#include <stdexcept>
#include <utility>

#include "nodes/player/live_graph.hpp"
#include "nodes/player/report_files.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

/// Of a goal's field: 0 is not given.
std::optional<double> given(double value) {
  return value == 0 ? std::nullopt : std::optional<double>(value);
}

ReplayResult resultOf(const replay::PlayPlan& plan, const replay::PlayReport& report) {
  ReplayResult result;
  result.completed = report.is_complete;
  result.behavior_id = plan.behavior.id;
  result.report = reportJson(report, -1);
  return result;
}

}  // namespace

PlayerNodeOptions PlayerNodeOptions::read(const ros::NodeHandle& private_node) {
  PlayerNodeOptions options;
  private_node.param("store", options.store, options.store);
  private_node.param("allow_motion", options.allow_motion, options.allow_motion);
  private_node.param("wait_for_subscribers", options.wait_for_subscribers_s,
                     options.wait_for_subscribers_s);
  options.needs_subscribers = parseUnheard(private_node.param("unheard", std::string()));
  private_node.param("clear_projection", options.clear_projection, options.clear_projection);
  private_node.param("hold", options.hold_s, options.hold_s);
  private_node.param("goal_wait", options.goal_wait_s, options.goal_wait_s);
  private_node.param("seek_lead", options.seek_lead_s, options.seek_lead_s);
  int queue = 100;
  private_node.param("queue", queue, queue);
  if (queue < 1) throw std::runtime_error("~queue has to be above 0");
  options.queue = static_cast<std::uint32_t>(queue);
  private_node.param("realtime", options.realtime, options.realtime);
  private_node.param("rules", options.rules, options.rules);
  private_node.param("limits", options.limits, options.limits);
  using Words = std::vector<std::string>;
  options.also = private_node.param("also", Words());
  options.latency_s = replay::parseLatency(private_node.param("latency", Words()));
  options.on_failure = replay::parseOnFailure(private_node.param("on_failure", Words()));
  private_node.param("report_folder", options.report_folder, options.report_folder);
  options.body = BodyOptions::read(private_node);
  private_node.param("anchor_frame", options.anchors.frame, options.anchors.frame);
  for (const std::string& anchor : private_node.param("anchor", std::vector<std::string>())) {
    options.anchors.add(anchor);
  }
  return options;
}

PlayerNode::PlayerNode(const PlayerNodeOptions& options)
    : options_(options),
      rules_(options.rules.empty() ? ReplayRules() : readRules(options.rules)),
      limits_(options.limits.empty() ? replay::MotionLimits::fetch() : readLimits(options.limits)),
      server_(
          node_, "replay", [this](const ReplayGoalConstPtr& goal) { onGoal(goal); }, false) {
  status_ = private_node_.advertise<ReplayStatus>("status", 1, true);
  const auto check = [this](const ReplayGoal& goal) {
    const auto store = replay::openStore(options_.store, replay::OpenMode::ReadOnly);
    ReplaySession(*store, requestOf(goal)).checkPlayable();
  };
  services_ = std::make_unique<PlayerServices>(
      private_node_, "replay", PlayerServices::Player{[this] { return session(); }, check});
  timer_ = node_.createWallTimer(ros::WallDuration(0.05), [this](const auto&) { onTimer(); });
  publishStatus("");
  server_.start();
}

PlayerNode::~PlayerNode() {
  services_.reset();
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

replay::PlanOptions PlayerNode::planOf(const ReplayGoal& goal) const {
  replay::PlanOptions plan;
  plan.topics = goal.topics;
  plan.exclude = goal.exclude;
  plan.regex = goal.regex;
  plan.exclude_regex = goal.exclude_regex;
  plan.prefix = goal.prefix;
  plan.remap = parseRenames(goal.remap);
  plan.start_s = goal.start;
  plan.duration_s = given(goal.duration);
  plan.until_s = given(goal.until);
  plan.also = goal.also;
  plan.settled = options_.also;
  plan.settled.insert(plan.settled.end(), rules_.also.begin(), rules_.also.end());
  plan.layers = projectedTopics(deadlineIn(kMasterPatience));
  plan.rewriting.rules = rules_.types;
  plan.rewriting.frames = parseRenames(goal.remap_frame);
  plan.rewriting.tf_prefix = goal.tf_prefix;
  return plan;
}

replay::PlayOptions PlayerNode::playOf(const ReplayGoal& goal) const {
  replay::PlayOptions play;
  play.rate = given(goal.rate).value_or(1.0);
  play.clear_projection = options_.clear_projection;
  play.hold_s = options_.hold_s;
  play.goal_wait_s = options_.goal_wait_s;
  play.seek_lead_s = given(goal.seek_lead).value_or(options_.seek_lead_s);
  play.latency_s = goal.latency.empty() ? options_.latency_s : replay::parseLatency(goal.latency);
  play.on_failure =
      goal.on_failure.empty() ? options_.on_failure : replay::parseOnFailure(goal.on_failure);
  play.is_in_step = !goal.ungated;
  play.is_looping = goal.loop;
  play.is_immediate = goal.immediate;
  play.starts_paused = goal.paused;
  play.keeps_alive = goal.keep_alive;
  play.skip_empty_s = given(goal.skip_empty);
  play.pause_topics = {goal.pause_topics.begin(), goal.pause_topics.end()};
  return play;
}

ReplayRequest PlayerNode::requestOf(const ReplayGoal& goal) const {
  ReplayRequest request;
  request.behavior_id = goal.behavior_id;
  request.name = goal.name;
  request.selector = goal.selector;
  request.only = goal.only;
  request.allow_motion = options_.allow_motion;
  request.everything = goal.everything;
  request.wait_for_subscribers_s =
      given(goal.wait_for_subscribers).value_or(options_.wait_for_subscribers_s);
  request.needs_subscribers =
      goal.unheard.empty() ? options_.needs_subscribers : parseUnheard(goal.unheard);
  request.delay_s = goal.delay;
  request.queue = options_.queue;
  request.is_realtime = options_.realtime;
  request.clock = parseReplayClock(goal.clock);
  request.clock_hz = given(goal.hz).value_or(request.clock_hz);
  request.rate_control.topic = goal.rate_control_topic;
  request.rate_control.longest_delay_s =
      given(goal.rate_control_max_delay).value_or(request.rate_control.longest_delay_s);
  request.limits = limits_;
  request.body = options_.body;
  request.anchors = options_.anchors;
  for (const std::string& anchor : goal.anchor) request.anchors.add(anchor);
  request.plan = planOf(goal);
  request.options = playOf(goal);
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
  if (report.is_complete) {
    ROS_INFO_STREAM("behavior " << result.behavior_id
                                << " was replayed; scheduling: " << report.scheduling);
  } else {
    ROS_WARN_STREAM("the replay of behavior " << result.behavior_id
                                              << " was stopped: " << report.reason);
  }
  for (const std::string& note : report.notes) {
    ROS_WARN_STREAM("replay of behavior " << result.behavior_id << ": " << note);
  }
  keepReport(report);
  if (report.is_complete) {
    server_.setSucceeded(result);
  } else if (server_.isPreemptRequested()) {
    server_.setPreempted(result, report.reason);
  } else {
    server_.setAborted(result, report.reason);
  }
}

void PlayerNode::keepReport(const replay::PlayReport& report) const {
  if (options_.report_folder.empty()) return;
  try {
    saveReport(options_.report_folder, report);
  } catch (const std::exception& error) {
    ROS_ERROR_STREAM("the report was not kept: " << error.what());
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

std::shared_ptr<ReplaySession> PlayerNode::session() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return session_;
}

void PlayerNode::onTimer() {
  const std::shared_ptr<ReplaySession> session = this->session();
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
  is_status_due_ = !is_status_due_;
  if (is_status_due_ || status().state != shown_state_) {
    publishStatus("");
  }
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
    status.rate = progress.rate;
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
