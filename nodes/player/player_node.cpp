#include "nodes/player/player_node.hpp"

#include <afterglow/Burst.h>
#include <afterglow/GetRate.h>
#include <afterglow/IsPaused.h>
#include <afterglow/ReplayActionGoal.h>
#include <afterglow/Seek.h>
#include <afterglow/SetRate.h>
#include <fmt/format.h>
#include <malloc.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "nodes/pages/replay_page.hpp"
#include "nodes/player/live_graph.hpp"
#include "nodes/player/play_options.hpp"
#include "nodes/player/robot_description.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

/// A node's name without the numbers that make an anonymous one unique: each `rosservice call` is a
/// node of its own, "/rosservice_4711_1700000000".
std::string withoutNumbers(std::string node) {
  for (;;) {
    const std::size_t end = node.find_last_not_of("0123456789");
    if (end == std::string::npos || end + 1 == node.size() || node[end] != '_') return node;
    node.resize(end);
  }
}

template <typename Response, typename Act>
bool answer(Response& response, const Act& act) {
  try {
    response.message = act();
    response.success = true;
  } catch (const std::exception& error) {
    response.message = error.what();
    response.success = false;
  }
  return true;
}

/// As the service has it: an empty field, and 0, is not given.
ReplayGoal goalOf(const PlayBehavior::Request& request) {
  ReplayGoal goal;
  goal.behavior = request.name.empty() ? request.selector : request.name;
  if (request.behavior_id != 0) goal.behavior = std::to_string(request.behavior_id);
  if (!request.only.empty()) goal.options.push_back("only=" + request.only);
  if (request.rate != 0) goal.options.push_back(fmt::format("rate={}", request.rate));
  if (request.start != 0) goal.options.push_back(fmt::format("start={}", request.start));
  if (request.paused) goal.options.push_back("pause");
  for (const std::string& topic : request.also) goal.options.push_back("also=" + topic);
  return goal;
}

}  // namespace

template <typename Service>
void PlayerServices::serve(const std::string& name, Command<Service> command) {
  using Event = ros::ServiceEvent<typename Service::Request, typename Service::Response>;
  const auto serveOne = [this, command = std::move(command)](Event& event) {
    return answer(event.getResponse(), [&] {
      const Session session = player_.session();
      if (!session) throw std::runtime_error("nothing is being replayed");
      return command(session, event.getRequest(), withoutNumbers(event.getCallerName()));
    });
  };
  servers_.push_back(
      node_.advertiseService<Event>(name, boost::function<bool(Event&)>(serveOne)));
}

std::string PlayerServices::setPaused(const Session& session, bool pauses,
                                      const std::string& caller) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::set<std::string>& pausers = pausersOf(session);
  if (pauses) {
    pausers.insert(caller);
  } else {
    pausers.erase(caller);
    needNoOthersPause(session, caller);
  }
  session->pause(pauses);
  return pauses ? "paused" : "resumed";
}

/// Needs the lock held.
std::set<std::string>& PlayerServices::pausersOf(const Session& session) {
  if (paused_.lock() != session || !session->isPaused()) pausers_.clear();
  paused_ = session;
  return pausers_;
}

/// Throws std::runtime_error where somebody else has paused it. With the lock held.
void PlayerServices::needNoOthersPause(const Session& session, const std::string& caller) {
  for (const std::string& pauser : pausersOf(session)) {
    if (pauser == caller) continue;
    throw std::runtime_error("it was paused by " + pauser +
                             ": it goes on only when that resumes it; ~stop ends it");
  }
}

PlayerServices::PlayerServices(const ros::NodeHandle& private_node, const std::string& action,
                               Player player)
    : node_(private_node), player_(std::move(player)) {
  goals_ = ros::NodeHandle().advertise<ReplayActionGoal>(action + "/goal", 1);
  using std_srvs::Trigger;
  serve<Trigger>("stop", [](const Session& session, const auto&, const auto&) {
    session->stop("stopped");
    return "stopped";
  });
  serve<Trigger>("pause", [this](const Session& session, const auto&, const auto& caller) {
    return setPaused(session, true, caller);
  });
  serve<Trigger>("resume", [this](const Session& session, const auto&, const auto& caller) {
    return setPaused(session, false, caller);
  });
  serve<Trigger>("toggle_paused", [this](const Session& session, const auto&, const auto& caller) {
    return setPaused(session, !session->isPaused(), caller);
  });
  serve<std_srvs::SetBool>("pause_playback", [this](const Session& session, const auto& request,
                                                    const auto& caller) {
    return setPaused(session, request.data, caller);
  });
  const auto playNext = [this](const Session& session, std::uint64_t count, const auto& caller) {
    const std::lock_guard<std::mutex> lock(mutex_);
    needNoOthersPause(session, caller);
    session->tell([&](replay::Player& playing) { playing.playNext(count); });
  };
  serve<Trigger>("play_next", [playNext](const Session& session, const auto&, const auto& caller) {
    playNext(session, 1, caller);
    return "played the next message";
  });
  serve<Burst>("burst", [playNext](const Session& session, const auto& request,
                                   const auto& caller) {
    constexpr std::uint64_t kAll = std::numeric_limits<std::uint32_t>::max();
    playNext(session, request.num_messages == 0 ? kAll : request.num_messages, caller);
    return "played at once";
  });
  serve<SetRate>("set_rate", [](const Session& session, const auto& request, const auto&) {
    session->setRate(request.rate);
    return "set";
  });
  serve<Seek>("seek", [](const Session& session, const auto& request, const auto&) {
    const replay::PlaybackTime to{static_cast<std::int64_t>(request.position * 1e9)};
    session->tell([&](replay::Player& playing) { playing.seek(to); });
    return "moved";
  });
  servers_.push_back(node_.advertiseService<IsPaused::Request, IsPaused::Response>(
      "is_paused", [this](IsPaused::Request&, IsPaused::Response& response) {
        const auto session = player_.session();
        response.paused = session && session->isPaused();
        return true;
      }));
  servers_.push_back(node_.advertiseService<GetRate::Request, GetRate::Response>(
      "get_rate", [this](GetRate::Request&, GetRate::Response& response) {
        const auto session = player_.session();
        response.rate = session ? session->progress().rate : 1.0;
        return true;
      }));
  servers_.push_back(node_.advertiseService("play", &PlayerServices::play, this));
  ros::NodeHandle slow(node_);
  slow.setCallbackQueue(&slow_requests_);
  servers_.push_back(slow.advertiseService<Rehearse::Request, Rehearse::Response>(
      "rehearse", [this](Rehearse::Request& request, Rehearse::Response& response) {
        player_.rehearse(request, response);
        return true;
      }));
  servers_.push_back(slow.advertiseService<LastReport::Request, LastReport::Response>(
      "last_report", [this](LastReport::Request&, LastReport::Response& response) {
        player_.last_report(response);
        return true;
      }));
  slow_thread_.start();
}

PlayerServices::~PlayerServices() {
  for (ros::ServiceServer& server : servers_) server.shutdown();
}

bool PlayerServices::play(PlayBehavior::Request& request, PlayBehavior::Response& response) {
  return answer(response, [&] {
    ReplayActionGoal message;  // without an id: the server gives it one
    message.goal = goalOf(request);
    player_.check(message.goal);
    if (goals_.getNumSubscribers() == 0) throw std::runtime_error("the player is not up yet");
    goals_.publish(message);
    return "begun";
  });
}

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
