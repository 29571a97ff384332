#include "nodes/player/player_node.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include <cmath>
#include <stdexcept>
#include <utility>

#include "nodes/player/live_graph.hpp"
#include "nodes/player/play_options.hpp"
#include "nodes/player/report_files.hpp"
#include "nodes/tools/store_parameter.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

/// A number, a text or true and false, as an option takes it.
std::string textOf(const XmlRpc::XmlRpcValue& value) {
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeBoolean:
      return bool(value) ? "true" : "false";
    case XmlRpc::XmlRpcValue::TypeInt:
      return std::to_string(int(value));
    case XmlRpc::XmlRpcValue::TypeDouble:
      return fmt::format("{}", double(value));
    case XmlRpc::XmlRpcValue::TypeString:
      return std::string(value);
    default:
      return value.toXml();  // which is no value of any option
  }
}

/// What a parameter says; an empty text or list says nothing: launch files have no other way.
OptionTexts textsOf(const ros::NodeHandle& node, const std::string& name) {
  XmlRpc::XmlRpcValue value;
  if (!node.getParam(name, value)) return {};
  if (value.getType() != XmlRpc::XmlRpcValue::TypeArray) {
    const std::string text = textOf(value);
    return text.empty() ? OptionTexts() : OptionTexts{text};
  }
  OptionTexts texts;
  for (int i = 0; i < value.size(); ++i) texts.push_back(textOf(value[i]));
  return texts;
}

OptionTexts parameterTexts(const ros::NodeHandle& node, const PlayOption& option) {
  if (option.keys.empty()) return textsOf(node, option.name);
  OptionTexts texts;
  for (const std::string& key : option.keys) {
    for (const std::string& text : textsOf(node, option.name + "/" + key)) {
      texts.push_back(key + "=" + text);
    }
  }
  return texts;
}

}  // namespace

PlayerNodeOptions PlayerNodeOptions::read(const ros::NodeHandle& private_node) {
  PlayerNodeOptions options;
  private_node.param("store", options.store, options.store);
  refuseStorePassword(private_node, options.store);
  private_node.param("report_folder", options.report_folder, options.report_folder);
  for (const FormerOption& former : formerOptions()) {
    if (private_node.hasParam(former.name)) {
      throw std::runtime_error("~" + std::string(former.name) + " has become ~" + former.now +
                               former.remark);
    }
  }
  ReplayRequest& replays = options.replays;
  for (const PlayOption& option : playOptions()) {
    try {
      const OptionTexts texts = parameterTexts(private_node, option);
      if (!texts.empty()) giveOption(replays, option, texts);
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error("~" + std::string(error.what()));
    }
  }
  // Named for all behaviors, some of which do not have them.
  replay::PlanOptions& plan = replays.plan;
  plan.settled.insert(plan.settled.begin(), plan.also.begin(), plan.also.end());
  plan.also.clear();
  return options;
}

PlayerNode::PlayerNode(const PlayerNodeOptions& options)
    : options_(options),
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

ReplayRequest PlayerNode::requestOf(const ReplayGoal& goal) const {
  ReplayRequest request = options_.replays;
  request.behavior = goal.behavior;
  giveGoalOptions(request, goal.options);
  lookAround(request, deadlineIn(kMasterPatience));
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
  // Each replay's threads took memory from arenas of their own, which glibc would keep.
  ::malloc_trim(0);
}

void PlayerNode::play(const ReplayRequest& request) {
  // Opened for each replay: what other processes recorded meanwhile, even into a new file, is
  // there.
  const auto store = replay::openStore(options_.store, replay::OpenMode::ReadOnly);
  const auto session = std::make_shared<ReplaySession>(*store, request);
  show(session, "");
  const replay::PlayReport report = session->run();
  ReplayResult result;
  result.completed = report.is_complete;
  result.behavior_id = session->plan().behavior.id;
  result.report = reportJson(report, -1);
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
  status.late_ms = status.skew_ms = NAN;
  if (session_) {
    const replay::PlayPlan& plan = session_->plan();
    const replay::PlayProgress progress = session_->progress();
    status.state = progress.state == replay::PlayProgress::State::Paused ? ReplayStatus::PAUSED
                                                                         : ReplayStatus::PLAYING;
    status.behavior_id = plan.behavior.id;
    status.behavior_name = plan.behavior.name;
    status.rate = progress.rate;
    status.position = progress.position.seconds();
    status.late_ms = progress.late_ms.value_or(NAN);
    status.skew_ms = progress.skew_ms.value_or(NAN);
    status.duration = replay::PlaybackTime{plan.durationNs()}.seconds();
    const std::string waits_for = session_->waitsFor();
    if (!waits_for.empty()) status.message = "the base waits: " + waits_for;
  }
  return status;
}

void PlayerNode::publishStatus(const std::string& message) {
  ReplayStatus now = status();
  if (!message.empty()) now.message = message;
  shown_state_ = now.state;
  status_.publish(now);
}

}  // namespace afterglow::nodes
