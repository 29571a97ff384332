#include "nodes/recorder/recorder_node.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <stdexcept>
#include <thread>

#include "nodes/recorder/recording_request.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

/// A behavior's last message and the call that stops its recording come on different connections;
/// so long does the recorder let the message overtake.
constexpr std::chrono::milliseconds kInFlight{50};

constexpr char kInterrupted[] = "interrupted";

replay::Stamp now() { return {static_cast<std::int64_t>(ros::Time::now().toNSec())}; }

replay::RecorderOptions recorderOptions(const RecorderNodeOptions& options) {
  replay::RecorderOptions chosen;
  chosen.queue_bytes = static_cast<std::size_t>(options.queue_megabytes) << 20;
  chosen.source = ros::this_node::getName();
  chosen.robot = options.robot;
  chosen.context_topics = options.context_topics;
  return chosen;
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    text += (text.empty() ? "" : ", ") + name;
  }
  return text;
}

}  // namespace

RecorderNodeOptions RecorderNodeOptions::read(const ros::NodeHandle& private_node) {
  RecorderNodeOptions options;
  private_node.param("store", options.store, options.store);
  private_node.param("robot", options.robot, options.robot);
  private_node.param("connect_timeout", options.connect_timeout_s, options.connect_timeout_s);
  private_node.param("queue_megabytes", options.queue_megabytes, options.queue_megabytes);
  if (private_node.hasParam("context_topics") &&
      !private_node.getParam("context_topics", options.context_topics)) {
    throw std::runtime_error("~context_topics must be a list of topic names");
  }
  if (options.queue_megabytes < 1) {
    throw std::runtime_error("~queue_megabytes must be at least 1");
  }
  return options;
}

RecorderNode::RecorderNode(const RecorderNodeOptions& options)
    : options_(options),
      store_(replay::openStore(options.store, replay::OpenMode::ReadWrite)),
      recorder_(*store_, recorderOptions(options)),
      listener_(recorder_),
      server_(
          node_, "record_behavior", [this](Goal goal) { onGoal(goal); },
          [this](Goal goal) { onCancel(goal); }, false) {
  listener_.acquire(options_.context_topics);
  start_service_ = private_node_.advertiseService("start_recording", &RecorderNode::onStart, this);
  stop_service_ = private_node_.advertiseService("stop_recording", &RecorderNode::onStop, this);
  timer_ = node_.createWallTimer(ros::WallDuration(1.0), [this](const auto&) { onTimer(); });
  server_.start();
}

RecorderNode::~RecorderNode() {
  start_service_.shutdown();
  stop_service_.shutdown();
  timer_.stop();
  endAll(kInterrupted);
}

// ------------------------------------------------------------------------------------- services

bool RecorderNode::onStart(StartRecording::Request& request, StartRecording::Response& response) {
  try {
    response.behavior_id = start(toBehavior(request), std::nullopt, &response.message);
    response.success = true;
  } catch (const std::exception& error) {
    response.success = false;
    response.message = error.what();
  }
  return true;
}

bool RecorderNode::onStop(StopRecording::Request& request, StopRecording::Response& response) {
  const std::vector<std::int64_t> ids = runningIds();
  const std::int64_t id =
      request.behavior_id != 0 || ids.empty() ? request.behavior_id : ids.back();
  const std::optional<Ended> ended =
      stop(id, request.outcome.empty() ? "stopped" : request.outcome);
  response.behavior_id = id;
  if (!ended) {
    response.success = false;
    response.message = id == 0 ? "nothing is being recorded"
                               : "behavior " + std::to_string(id) + " is not being recorded";
    return true;
  }
  response.success = ended->problem.empty();
  response.message = ended->problem;
  response.messages = ended->counts.stored;
  response.dropped = ended->counts.dropped;
  return true;
}

// --------------------------------------------------------------------------------------- action

void RecorderNode::onGoal(Goal goal) {
  try {
    toBehavior(*goal.getGoal());
  } catch (const std::exception& error) {
    goal.setRejected({}, error.what());
    return;
  }
  goal.setAccepted();
  later([this, goal] { startGoal(goal); });
}

void RecorderNode::startGoal(Goal goal) {
  try {
    std::string warning;
    const std::int64_t id = start(toBehavior(*goal.getGoal()), goal, &warning);
    RecordBehaviorFeedback feedback;
    feedback.behavior_id = id;
    goal.publishFeedback(feedback);
    bool is_canceled = false;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      is_canceled = canceled_.erase(goal.getGoalID().id) != 0;
    }
    if (is_canceled) {
      stop(id, "stopped");
    }
  } catch (const std::exception& error) {
    goal.setAborted({}, error.what());
  }
}

void RecorderNode::onCancel(Goal goal) {
  std::optional<std::int64_t> id;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    id = behaviorOf(goal);
    if (!id) {
      canceled_.insert(goal.getGoalID().id);
    }
  }
  if (id) {
    later([this, running = *id] { stop(running, "stopped"); });
  }
}

void RecorderNode::finishGoal(Goal goal, std::int64_t id, const std::string& outcome,
                              const Ended& ended) {
  RecordBehaviorResult result;
  result.behavior_id = id;
  result.outcome = outcome;
  result.messages = ended.counts.stored;
  result.dropped = ended.counts.dropped;
  result.silent_topics = ended.counts.silent_topics;
  const std::uint8_t status = goal.getGoalStatus().status;
  if (!ended.problem.empty()) {
    goal.setAborted(result, ended.problem);
  } else if (outcome == kInterrupted) {
    goal.setAborted(result, "the recorder was stopped");
  } else if (status == actionlib_msgs::GoalStatus::PREEMPTING) {
    goal.setCanceled(result);
  } else {
    goal.setSucceeded(result);
  }
}

void RecorderNode::onTimer() {
  const std::optional<std::string> failure = recorder_.failure();
  std::map<std::int64_t, Running> running;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    running = running_;
  }
  for (auto& [id, entry] : running) {
    if (failure) {
      ROS_ERROR_STREAM("behavior " << id << " is cut short: " << *failure);
      stop(id, kInterrupted);
    } else if (entry.goal) {
      const replay::RecordedCounts counts = recorder_.counts(id);
      RecordBehaviorFeedback feedback;
      feedback.behavior_id = id;
      feedback.messages = counts.stored;
      feedback.dropped = counts.dropped;
      entry.goal->publishFeedback(feedback);
    }
  }
}

// ---------------------------------------------------------------------------------- the job itself

std::int64_t RecorderNode::start(const replay::Behavior& behavior, std::optional<Goal> goal,
                                 std::string* warning) {
  if (ros::Time::now().isZero()) {
    throw std::runtime_error("ROS time is zero: use_sim_time is set, but nobody publishes /clock");
  }
  listener_.acquire(behavior.topics);
  try {
    const std::vector<std::string> missing =
        waitForPublishers(behavior.topics, deadlineIn(options_.connect_timeout_s));
    if (!missing.empty()) {
      *warning = "no connection yet from " + joined(missing);
      ROS_WARN_STREAM("behavior '" << behavior.name << "': " << *warning);
    }
    listener_.drain();  // what came so far is known: latched messages count as the state at begin
    replay::Behavior begun = behavior;
    begun.begin = now();
    begun = recorder_.begin(begun);
    const std::lock_guard<std::mutex> lock(mutex_);
    running_[begun.id] = {begun.topics, std::move(goal)};
    ROS_INFO_STREAM("recording behavior " << begun.id << " '" << begun.name << "'");
    return begun.id;
  } catch (...) {
    listener_.release(behavior.topics);
    throw;
  }
}

std::optional<RecorderNode::Ended> RecorderNode::stop(std::int64_t id, const std::string& outcome) {
  Running running;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = running_.find(id);
    if (found == running_.end()) {
      return std::nullopt;
    }
    running = std::move(found->second);
    running_.erase(found);
  }
  std::this_thread::sleep_for(kInFlight);
  const replay::Stamp end = now();
  listener_.drain();
  Ended ended;
  try {
    ended.counts = recorder_.end(id, end, outcome);
  } catch (const replay::StoreError& error) {
    ended.problem = error.what();
  }
  ended.problem = recorder_.failure().value_or(ended.problem);
  listener_.release(running.topics);
  if (ended.counts.dropped > 0) {
    ROS_WARN_STREAM("behavior " << id << ": " << ended.counts.dropped << " messages were dropped");
  }
  if (!ended.counts.silent_topics.empty()) {
    ROS_WARN_STREAM("behavior " << id << ": nothing on " << joined(ended.counts.silent_topics));
  }
  if (running.goal) {
    finishGoal(*running.goal, id, outcome, ended);
  }
  return ended;
}

void RecorderNode::endAll(const std::string& outcome) {
  std::vector<std::future<void>> jobs;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_closing_ = true;
    jobs.swap(jobs_);
  }
  for (std::future<void>& job : jobs) {
    job.wait();
  }
  for (const std::int64_t id : runningIds()) {
    stop(id, outcome);
  }
}

std::optional<std::int64_t> RecorderNode::behaviorOf(const Goal& goal) const {
  for (const auto& [id, running] : running_) {
    if (running.goal && *running.goal == goal) {
      return id;
    }
  }
  return std::nullopt;
}

std::vector<std::int64_t> RecorderNode::runningIds() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::int64_t> ids;
  for (const auto& [id, running] : running_) {
    ids.push_back(id);
  }
  return ids;
}

void RecorderNode::later(std::function<void()> job) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (is_closing_) {
    return;
  }
  const auto is_done = [](const std::future<void>& running) {
    return running.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  };
  jobs_.erase(std::remove_if(jobs_.begin(), jobs_.end(), is_done), jobs_.end());
  jobs_.push_back(std::async(std::launch::async, std::move(job)));
}

}  // namespace afterglow::nodes
