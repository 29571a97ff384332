#include "nodes/player/player_node.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "nodes/pages/replay_page.hpp"
#include "nodes/player/live_graph.hpp"
#include "nodes/player/play_options.hpp"
#include "nodes/player/robot_description.hpp"
#include "nodes/tools/robot_namespace.hpp"
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

/// Returns the fastest of each unit: "up to 0.2 m/s (linear velocity), 0.45 rad/s (...)".
std::string speedText(const std::vector<replay::MotionPeak>& peaks, double rate) {
  std::map<std::string, std::pair<double, std::string>> fastest;
  for (const replay::MotionPeak& peak : peaks) {
    if (peak.power != 1) continue;
    auto& [value, what] = fastest[peak.unit];
    if (!what.empty() && std::abs(peak.value) <= value) continue;
    value = std::abs(peak.value);
    what = peak.what;
  }
  std::vector<std::string> parts;
  for (const auto& [unit, peak] : fastest) {
    parts.push_back(fmt::format("{:.2f} {} ({})", peak.first * rate, unit, peak.second));
  }
  if (parts.empty()) return fmt::format("{} times as fast as it was", rate);
  return fmt::format("up to {}", fmt::join(parts, ", "));
}

std::string robotName(const replay::Store& store, const replay::PlayPlan& plan,
                      const ReplayRequest& request) {
  if (!request.body.robot.name.empty()) return request.body.robot.name;
  const std::string name = recordedJoints(store, plan.behavior, request.body.robot).robotName();
  return name.empty() ? "the robot" : name;
}

std::string topicsJson(const replay::PlayPlan& plan) {
  auto topics = nlohmann::ordered_json::array();
  for (const replay::PlannedTopic& topic : plan.topics) {
    const std::string& name = topic.output.topic;
    topics.push_back({{"topic", name.empty() ? topic.channel.topic : name},
                      {"type", topic.channel.type},
                      {"published", topic.isPlayed()},
                      {"reason", reasonOf(topic)}});
  }
  return topics.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
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
      private_node_, "replay",
      PlayerServices::Player{[this] { return session(); }, check,
                             [this](const auto& asked, auto& told) { rehearse(asked, told); },
                             [this](auto& told) { tellLastReport(told); }});
  timer_ = node_.createWallTimer(ros::WallDuration(0.05), [this](const auto&) { onTimer(); });
  publishStatus("");
  server_.start();
}

PlayerNode::~PlayerNode() {
  close("the player was shut down");  // which ends a rehearsal, too
  services_.reset();
  timer_.stop();
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

void PlayerNode::keepReport(const replay::PlayReport& report) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    last_report_ = report;
  }
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

void PlayerNode::rehearse(const Rehearse::Request& asked, Rehearse::Response& told) const {
  told.store = replay::storeUri(options_.store);
  try {
    ReplayGoal goal;
    goal.behavior = asked.behavior;
    goal.options = asked.options;
    const ReplayRequest request = requestOf(goal);
    const auto store = replay::openStore(options_.store, replay::OpenMode::ReadOnly);
    ReplaySession session(*store, request);
    const replay::PlayPlan& plan = session.plan();
    told.topics = topicsJson(plan);
    told.moves = !plan.motionTopics().empty();
    if (told.moves) {
      told.robot = robotName(*store, plan, request);
      told.speed = speedText(session.peaks(), request.options.rate);
    }
    const Rehearsal rehearsal = session.rehearse(true, [this] { return isClosing(); });
    told.message = fmt::format("{}", fmt::join(rehearsal.refusals, "; "));
    told.unchecked = fmt::format("{}", fmt::join(rehearsal.unchecked, "; "));
  } catch (const std::exception& error) {
    told.message = error.what();
  }
  told.success = told.message.empty();
}

void PlayerNode::tellLastReport(LastReport::Response& told) const {
  std::optional<replay::PlayReport> report;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    report = last_report_;
  }
  told.success = report.has_value();
  if (!report) {
    told.message = "no replay has ended since the player began";
    return;
  }
  told.report = reportJson(*report, -1);
  told.page = replayPage({*report}, "");
}

bool PlayerNode::isClosing() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return is_closing_ || !ros::ok();
}

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
    using State = replay::PlayProgress::State;
    const bool is_on_its_way = progress.state == State::Idle && session_->goesToStart();
    status.state = is_on_its_way                     ? ReplayStatus::TO_START
                   : progress.state == State::Paused ? ReplayStatus::PAUSED
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
