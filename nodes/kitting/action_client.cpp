#include "nodes/kitting/action_client.hpp"

#include <fmt/format.h>

#include "replay/plan/rewrite.hpp"

namespace afterglow::nodes {

using actionlib_msgs::GoalStatus;

void sleepFor(double seconds) {
  if (seconds > 0) ros::Duration(seconds).sleep();
  if (!ros::ok()) throw TaskError("interrupted");
}

bool waitUntil(const std::function<bool()>& condition, double seconds) {
  const ros::WallTime deadline = ros::WallTime::now() + ros::WallDuration(seconds);
  while (!condition()) {
    if (ros::WallTime::now() > deadline) return false;
    sleepFor(0.01);
  }
  return true;
}

ActionClient::ActionClient(std::string who, const std::string& action, const ros::Publisher& goals)
    : who_(std::move(who)),
      goals_(goals),
      fresh_id_(replay::uniqueGoalIds(ros::this_node::getName())),
      statuses_(
          ros::NodeHandle().subscribe(action + "/status", 20, &ActionClient::onStatus, this)) {}

bool ActionClient::isServed() const {
  return goals_.getNumSubscribers() > 0 && statuses_.getNumPublishers() > 0;
}

std::string ActionClient::begin() {
  const std::lock_guard<std::mutex> lock(mutex_);
  status_ = GoalStatus();
  return status_.goal_id.id = fresh_id_();
}

void ActionClient::onStatus(const actionlib_msgs::GoalStatusArray& statuses) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const GoalStatus& status : statuses.status_list) {
    if (status.goal_id.id == status_.goal_id.id) status_ = status;
  }
}

GoalStatus ActionClient::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return status_;
}

bool ActionClient::isOver() const {
  const std::uint8_t is = status().status;
  return is != GoalStatus::PENDING && is != GoalStatus::ACTIVE && is != GoalStatus::PREEMPTING &&
         is != GoalStatus::RECALLING;
}

void ActionClient::expectSuccess(double seconds) const {
  if (!waitUntil([this] { return isOver(); }, seconds)) {
    throw TaskError(fmt::format("{} did not finish within {:.1f} s", who_, seconds));
  }
  const GoalStatus is = status();
  if (is.status == GoalStatus::SUCCEEDED) return;
  throw TaskError(fmt::format("{} gave up (status {}): {}", who_, is.status, is.text));
}

}  // namespace afterglow::nodes
