/// \file
/// The recorder's two actions in terms of RecordingManager: record_behavior, and mongodb_logger as
/// the paper's code calls it (robot-behavior-replay, server/mongodb_logger_action_server.py).
#pragma once

#include <actionlib/server/action_server.h>
#include <afterglow/RecordBehaviorAction.h>
#include <mongodb/MongoDBLoggerAction.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <future>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "nodes/recorder/recording_manager.hpp"

namespace afterglow::nodes {

/// Any number of goals at once. The first feedback says that every subscription stands. Translation
/// has three static functions: request(goal), which throws if it cannot be recorded,
/// feedback(id, counts) and result(id, ended). The manager must outlive this.
template <class Action, class Translation>
class GoalRecorder {
 public:
  GoalRecorder(ros::NodeHandle node, const std::string& name, RecordingManager& manager)
      : manager_(manager),
        server_(
            node, name, [this](Goal goal) { onGoal(goal); }, [this](Goal goal) { onCancel(goal); },
            false) {
    server_.start();
  }
  ~GoalRecorder() { finishJobs(); }
  GoalRecorder(const GoalRecorder&) = delete;
  GoalRecorder& operator=(const GoalRecorder&) = delete;

  /// Tells feedback once a second.
  void tell() {
    std::map<std::int64_t, Goal> running;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      running = running_;
    }
    for (auto& [id, goal] : running) {
      goal.publishFeedback(Translation::feedback(id, manager_.counts(id)));
    }
  }

  /// Accepts no goals any more, and waits for starts and stops under way.
  void finishJobs() {
    std::vector<std::future<void>> jobs;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      is_closing_ = true;
      jobs.swap(jobs_);
    }
    for (std::future<void>& job : jobs) {
      job.wait();
    }
  }

 private:
  using Server = actionlib::ActionServer<Action>;
  using Goal = typename Server::GoalHandle;

  void onGoal(Goal goal) {
    try {
      const RecordingRequest request = Translation::request(*goal.getGoal());
      goal.setAccepted();
      later([this, goal, request] { start(goal, request); });
    } catch (const std::exception& error) {
      goal.setRejected({}, error.what());
    }
  }

  void start(Goal goal, const RecordingRequest& request) {
    try {
      std::string warning;
      const auto on_end = [this, goal](std::int64_t id, const RecordingManager::Ended& ended) {
        finish(goal, id, ended);
      };
      const std::int64_t id = manager_.start(request, on_end, &warning);
      goal.publishFeedback(Translation::feedback(id, manager_.counts(id)));
      bool is_canceled = false;
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        is_canceled = canceled_.erase(goal.getGoalID().id) != 0;
        if (ended_.erase(id) == 0) running_.emplace(id, goal);
      }
      if (is_canceled) {
        manager_.stop(id, "stopped");
      }
    } catch (const std::exception& error) {
      goal.setAborted({}, error.what());
    }
  }

  void onCancel(Goal goal) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = std::find_if(running_.begin(), running_.end(),
                                    [&](const auto& entry) { return entry.second == goal; });
    if (found == running_.end()) {
      canceled_.insert(goal.getGoalID().id);
    } else {
      laterLocked([this, id = found->first] { manager_.stop(id, "stopped"); });
    }
  }

  void finish(Goal goal, std::int64_t id, const RecordingManager::Ended& ended) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (running_.erase(id) == 0) ended_.insert(id);
    }
    const auto result = Translation::result(id, ended);
    if (!ended.problem.empty()) {
      goal.setAborted(result, ended.problem);
    } else if (goal.getGoalStatus().status == actionlib_msgs::GoalStatus::PREEMPTING) {
      goal.setCanceled(result);
    } else {
      goal.setSucceeded(result);
    }
  }

  void later(std::function<void()> job) {
    const std::lock_guard<std::mutex> lock(mutex_);
    laterLocked(std::move(job));
  }

  void laterLocked(std::function<void()> job) {
    if (is_closing_) {
      return;
    }
    const auto is_done = [](const std::future<void>& running) {
      return running.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    };
    jobs_.erase(std::remove_if(jobs_.begin(), jobs_.end(), is_done), jobs_.end());
    jobs_.push_back(std::async(std::launch::async, std::move(job)));
  }

  RecordingManager& manager_;
  std::mutex mutex_;  ///< never held while calling actionlib, which locks around callbacks
  std::map<std::int64_t, Goal> running_;
  std::set<std::int64_t> ended_;    ///< goals that ended before they were in running_
  std::set<std::string> canceled_;  ///< goals canceled before they had started
  std::vector<std::future<void>> jobs_;
  bool is_closing_ = false;
  Server server_;  ///< last: its callbacks use all of the above
};

struct RecordBehaviorTranslation {
  static RecordingRequest request(const RecordBehaviorGoal& goal) { return toRequest(goal); }
  static RecordBehaviorFeedback feedback(std::int64_t id, const replay::RecordedCounts& counts);
  static RecordBehaviorResult result(std::int64_t id, const RecordingManager::Ended& ended);
};

/// Topics joined by ':'. Feedback is how many messages there are (the original sends the text of
/// them all, again every second); the result the topics that were heard, joined as in the goal.
struct MongoDBLoggerTranslation {
  static RecordingRequest request(const mongodb::MongoDBLoggerGoal& goal);
  static mongodb::MongoDBLoggerFeedback feedback(std::int64_t id,
                                                 const replay::RecordedCounts& counts);
  static mongodb::MongoDBLoggerResult result(std::int64_t id, const RecordingManager::Ended& ended);
};

}  // namespace afterglow::nodes
