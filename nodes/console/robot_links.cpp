#include "nodes/console/robot_links.hpp"

#include <actionlib_msgs/GoalStatus.h>
#include <afterglow/ReplayActionGoal.h>
#include <afterglow/Seek.h>
#include <afterglow/SetRate.h>
#include <fmt/format.h>
#include <std_srvs/Trigger.h>

#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "nodes/console/http_message.hpp"
#include "replay/plan/topic_role.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {
namespace {

std::string actionOf(const std::string& player) {
  return player.substr(0, player.rfind('/') + 1) + "replay";
}

}  // namespace

bool PlayRequest::isWithoutBody() const {
  const std::set<replay::Modality> asked = replay::parseModalities(only);
  return !asked.empty() && asked.count(replay::Modality::Body) == 0;
}

std::vector<std::string> PlayRequest::options() const {
  std::vector<std::string> options{fmt::format("rate={}", rate)};
  if (!only.empty()) options.push_back("only=" + only);
  if (start != 0) options.push_back(fmt::format("start={}", start));
  if (is_looping) options.push_back("loop");
  return options;
}

std::string PlayRequest::key() const {
  return fmt::format("{} {}", behavior, fmt::join(options(), " "));
}

PlayRequest readPlayRequest(const nlohmann::json& asked) {
  PlayRequest request;
  const auto behavior = asked.find("behavior");
  if (behavior == asked.end() || !behavior->is_number_integer()) {
    throw HttpError(400, "behavior is missing: its id");
  }
  request.behavior = behavior->get<std::int64_t>();
  request.only = textIn(asked, "only");
  try {
    (void)request.isWithoutBody();
  } catch (const std::invalid_argument& error) {
    throw HttpError(400, error.what());
  }
  request.rate = numberIn(asked, "rate", 1);
  request.start = numberIn(asked, "start", 0);
  if (request.rate < 1e-3) throw HttpError(400, "rate is too small");
  if (request.start < 0) throw HttpError(400, "start should not be negative");
  request.is_looping = flagIn(asked, "loop");
  return request;
}

// ------------------------------------------------------------------------------------------- link

PlayerLink::PlayerLink(const std::string& player) : player_(ros::names::resolve(player)) {
  const std::string action = actionOf(player_);
  goals_ = node_.advertise<ReplayActionGoal>(action + "/goal", 4);
  cancels_ = node_.advertise<actionlib_msgs::GoalID>(action + "/cancel", 4);
  status_ = node_.subscribe<ReplayStatus>(player_ + "/status", 10,
                                          [this](const auto& status) { onStatus(*status); });
  feedback_ = node_.subscribe<ReplayActionFeedback>(
      action + "/feedback", 10, [this](const auto& feedback) { onFeedback(*feedback); });
  results_ = node_.subscribe<ReplayActionResult>(action + "/result", 10,
                                                 [this](const auto& result) { onResult(*result); });
}

bool PlayerLink::isThere() const {
  return status_.getNumPublishers() > 0 && results_.getNumPublishers() > 0 &&
         goals_.getNumSubscribers() > 0 && cancels_.getNumSubscribers() > 0;
}

std::optional<ReplayStatus> PlayerLink::status() const {
  if (!isThere()) return std::nullopt;
  const std::lock_guard<std::mutex> lock(mutex_);
  return newest_;
}

std::string PlayerLink::newGoal() {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::string goal = ros::this_node::getName() + "-" + std::to_string(++goals_sent_) + "-" +
                     replay::newKey();
  courses_.clear();
  courses_[goal] = {};
  return goal;
}

void PlayerLink::send(const std::string& goal, const PlayRequest& request) {
  ReplayActionGoal message;
  message.goal_id.id = goal;
  message.goal_id.stamp = message.header.stamp = ros::Time::now();
  message.goal.behavior = std::to_string(request.behavior);
  message.goal.options = request.options();
  goals_.publish(message);
}

PlayerLink::Course PlayerLink::course(const std::string& goal) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto course = courses_.find(goal);
  return course == courses_.end() ? Course{} : course->second;
}

PlayerLink::Course PlayerLink::await(const std::string& goal, std::chrono::milliseconds patience) {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait_for(lock, patience, [&] {
    const auto course = courses_.find(goal);
    return course == courses_.end() || course->second.is_begun || course->second.is_ended;
  });
  const auto course = courses_.find(goal);
  return course == courses_.end() ? Course{} : course->second;
}

bool PlayerLink::cancel(const std::string& goal) {
  const bool is_heard = cancels_.getNumSubscribers() > 0;
  if (!goal.empty()) {
    // A goal that comes after its cancel is canceled when it comes: of other goals, only those that
    // are there are.
    actionlib_msgs::GoalID one;
    one.id = goal;
    cancels_.publish(one);
  }
  cancels_.publish(actionlib_msgs::GoalID());
  return is_heard;
}

template <typename Service>
typename Service::Response PlayerLink::ask(const std::string& name,
                                           const typename Service::Request& request) const {
  Service service;
  service.request = request;
  if (ros::service::call(player_ + "/" + name, service)) return service.response;
  throw HttpError(503, player_ + " does not answer");
}

template <typename Service>
void PlayerLink::call(const std::string& name, const typename Service::Request& request) const {
  const auto answer = ask<Service>(name, request);
  if (!answer.success) throw HttpError(409, answer.message);
}

void PlayerLink::trigger(const std::string& service) const {
  call<std_srvs::Trigger>(service, {});
}

void PlayerLink::setRate(double rate) const {
  SetRate::Request request;
  request.rate = rate;
  call<SetRate>("set_rate", request);
}

void PlayerLink::seek(double seconds) const {
  Seek::Request request;
  request.position = seconds;
  call<Seek>("seek", request);
}

Rehearse::Response PlayerLink::rehearse(const PlayRequest& request) const {
  Rehearse::Request asked;
  asked.behavior = std::to_string(request.behavior);
  asked.options = request.options();
  return ask<Rehearse>("rehearse", asked);
}

LastReport::Response PlayerLink::lastReport() const { return ask<LastReport>("last_report", {}); }

void PlayerLink::onStatus(const ReplayStatus& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  newest_ = status;
}

void PlayerLink::onFeedback(const ReplayActionFeedback& feedback) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto course = courses_.find(feedback.status.goal_id.id);
    if (course != courses_.end()) course->second.is_begun = true;
  }
  changed_.notify_all();
}

void PlayerLink::onResult(const ReplayActionResult& result) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto course = courses_.find(result.status.goal_id.id);
    if (course == courses_.end()) return;
    Course& ours = course->second;
    ours.is_ended = true;
    ours.is_completed = result.result.completed;
    ours.words = result.status.text;
    ours.report = result.result.report;
  }
  changed_.notify_all();
}

CalibratorLink::CalibratorLink(const std::string& calibrator)
    : calibrator_(ros::names::resolve(calibrator)) {
  statuses_ = node_.subscribe<std_msgs::String>(calibrator_ + "/status", 10,
                                                [this](const auto& status) { onStatus(*status); });
  guidance_ = node_.subscribe<std_msgs::String>(
      calibrator_ + "/guidance", 20, [this](const auto& guidance) { onGuidance(*guidance); });
}

nlohmann::ordered_json CalibratorLink::state() const {
  if (statuses_.getNumPublishers() == 0) return nullptr;
  const std::lock_guard<std::mutex> lock(mutex_);
  nlohmann::ordered_json state = status_;
  if (!state.is_null()) state["said"] = said_;
  return state;
}

bool CalibratorLink::isCommand(const std::string& name) {
  static const std::set<std::string> commands{"start", "stop", "take", "solve", "discard_last"};
  return commands.count(name) > 0;
}

std::string CalibratorLink::trigger(const std::string& command) const {
  std_srvs::Trigger service;
  if (!ros::service::call(calibrator_ + "/" + command, service)) {
    throw HttpError(503, calibrator_ + " does not answer");
  }
  if (!service.response.success) throw HttpError(409, service.response.message);
  return service.response.message;
}

void CalibratorLink::onStatus(const std_msgs::String& status) {
  auto told = nlohmann::ordered_json::parse(status.data, nullptr, false);
  if (!told.is_object()) return;  // of another node of this name
  const std::lock_guard<std::mutex> lock(mutex_);
  status_ = std::move(told);
}

void CalibratorLink::onGuidance(const std_msgs::String& guidance) {
  const std::lock_guard<std::mutex> lock(mutex_);
  said_.push_front(guidance.data);
  if (said_.size() > kMostSaid) said_.pop_back();
}

}  // namespace afterglow::nodes
