#include "nodes/recorder/recording_manager.hpp"

#include <fmt/format.h>
#include <ros/ros.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <stdexcept>
#include <thread>

#include "nodes/recorder/topic_listener.hpp"
#include "nodes/recorder/world_snapshot.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/query/time_text.hpp"
#include "replay/store/behavior_edit.hpp"

namespace afterglow::nodes {
namespace {

/// A new behavior may begin ~pre_roll ago; so much earlier nothing is asked for any more.
constexpr std::int64_t kLongBefore_ns = 60'000'000'000;

void pruneOrWarn(replay::Store& store, const replay::RetentionPolicy& policy) {
  try {
    replay::prune(store, policy, [](const replay::Behavior& behavior) {
      ROS_INFO_STREAM("behavior " << behavior.id << " '" << behavior.name << "' made room");
    });
  } catch (const replay::StoreError& error) {
    ROS_WARN_STREAM("making room: " << error.what());
  }
}

}  // namespace

StoreSpace::StoreSpace(const RecorderNodeOptions& options, replay::RecorderStore& store)
    : options_(options), store_(store), folder_(store.local().folder()) {}

replay::DiskState StoreSpace::disk() const {
  const auto min_space = static_cast<std::uint64_t>(options_.min_space_megabytes) << 20;
  const std::optional<std::uint64_t> free =
      folder_.empty() ? std::nullopt : replay::freeBytes(folder_);
  if (!free) return {};
  replay::DiskState state = replay::judgeDisk(folder_, *free, min_space);
  if (!state.text.empty()) state.text += "; " + options_.space_advice;
  return state;
}

void StoreSpace::makeRoom() {
  const auto now_ns = static_cast<std::int64_t>(ros::Time::now().toNSec());
  try {
    store_.removeSent({now_ns - std::llround(options_.pre_roll_s * 1e9) - kLongBefore_ns});
  } catch (const replay::StoreError& error) {
    ROS_WARN_STREAM("making room: " << error.what());
  }
  if (options_.retention_days <= 0 && options_.retention_gigabytes <= 0) {
    return;
  }
  replay::RetentionPolicy policy;
  policy.keep_tags = options_.keep_tags;
  if (options_.retention_days > 0) {
    policy.ended_before = {now_ns - std::llround(options_.retention_days * 86400e9)};
  }
  if (options_.retention_gigabytes > 0) {
    policy.most_bytes = static_cast<std::uint64_t>(options_.retention_gigabytes * 1e9);
  }
  store_.tend([policy](replay::Store& store) { pruneOrWarn(store, policy); });
}

namespace {

/// The outcome of a behavior that ends because recording does.
constexpr char kInterrupted[] = "interrupted";

/// A behavior's last message and the call that stops its recording come on different connections;
/// so long does the recorder let the message overtake.
constexpr std::chrono::milliseconds kInFlight{50};
/// And so long, if the network thread is behind with reading its sockets.
constexpr std::chrono::milliseconds kLongestBehind{1000};

void letMessagesArrive() {
  const auto begin = std::chrono::steady_clock::now();
  std::this_thread::sleep_for(kInFlight);
  while (hasUnreadInput() && std::chrono::steady_clock::now() - begin < kLongestBehind) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

replay::RecorderOptions recorderOptions(const RecorderNodeOptions& options) {
  replay::RecorderOptions chosen;
  chosen.queue_bytes = static_cast<std::size_t>(options.queue_megabytes) << 20;
  chosen.source = ros::this_node::getName();
  chosen.robot = options.robot;
  chosen.context_topics = options.context_topics;
  chosen.pre_roll = std::chrono::nanoseconds(std::llround(options.pre_roll_s * 1e9));
  chosen.pre_roll_bytes = static_cast<std::size_t>(options.pre_roll_megabytes) << 20;
  return chosen;
}

std::vector<std::string> withAnswers(const std::vector<std::string>& topics) {
  std::vector<std::string> heard = topics;
  for (const std::string& topic : topics) {
    for (const std::string& answer : replay::goalTopics(topic)) {
      if (std::find(heard.begin(), heard.end(), answer) == heard.end()) heard.push_back(answer);
    }
  }
  return heard;
}

replay::Stamp rosNow() { return {static_cast<std::int64_t>(ros::Time::now().toNSec())}; }

}  // namespace

RecordingManager::RecordingManager(const RecorderNodeOptions& options,
                                   replay::RecorderStore& store, const StoreSpace& space)
    : options_(options),
      store_(store),
      space_(space),
      recorder_(store_.local(), recorderOptions(options)),
      listener_(recorder_),
      world_(options_, store_.local()) {
  listener_.acquire(options_.context_topics);
  listener_.acquire(options_.pre_roll_topics);
}

RecordingManager::~RecordingManager() { interruptAll("the recorder was stopped"); }

// -------------------------------------------------------------------------------------- starting

std::vector<std::string> RecordingManager::topicsNow(const RecordingRequest& request) const {
  std::vector<std::string> topics = request.behavior.topics;
  if (!request.choice.isOpen()) {
    return topics;
  }
  std::set<std::string> candidates;
  const RosGraph graph = askMaster(deadlineIn(1.0));
  for (const auto& [topic, publishers] : graph.publishers) {
    if (!graph.otherPublishers(topic).empty()) candidates.insert(topic);
  }
  // Their last publisher may be gone, and they be remembered.
  for (const std::string& topic : listener_.topics()) candidates.insert(topic);
  for (const std::string& topic : candidates) {
    const bool is_new = std::find(topics.begin(), topics.end(), topic) == topics.end();
    if (is_new && request.choice.matches(topic)) topics.push_back(topic);
  }
  return topics;
}

Links RecordingManager::oldLinks(const std::vector<std::string>& topics) const {
  const std::vector<std::string> heard = listener_.topics();
  std::vector<std::string> unheard;
  std::copy_if(topics.begin(), topics.end(), std::back_inserter(unheard),
               [&](const std::string& topic) {
                 return std::find(heard.begin(), heard.end(), topic) == heard.end();
               });
  return unheard.empty() ? Links() : linksHere(unheard, deadlineIn(options_.connect_timeout_s / 2));
}

std::int64_t RecordingManager::start(const RecordingRequest& request, const OnEnd& on_end,
                                     std::string* warning) {
  const replay::DiskState disk = space_.disk();
  if (disk.level == replay::DiskState::Level::Full) throw std::runtime_error(disk.text);
  requireTime(deadlineIn(options_.connect_timeout_s));
  const std::vector<std::string> topics = topicsNow(request);
  std::unique_lock<std::mutex> one_by_one(subscribing_mutex_);
  const std::vector<std::string> heard = withAnswers(topics);
  const Links old = oldLinks(heard);
  listener_.acquire(heard);
  one_by_one.unlock();
  try {
    const std::vector<std::string> missing =
        waitForPublishers(heard, deadlineIn(options_.connect_timeout_s), old);
    if (!missing.empty()) {
      *warning = fmt::format("no connection yet from {}", fmt::join(missing, ", "));
      ROS_WARN_STREAM("behavior '" << request.behavior.name << "': " << *warning);
    }
    return begin({request, topics, heard, {}, on_end, 0});
  } catch (...) {
    listener_.release(heard);
    throw;
  }
}

std::int64_t RecordingManager::begin(Running running) {
  replay::Behavior behavior = running.request.behavior;
  behavior.topics = running.topics;
  behavior.calibration = world_.calibration();
  running.snapshot.urdf = world_.urdf();
  running.snapshot.map = world_.map();
  running.snapshot.robot = world_.robot();
  running.snapshot.begin = world_.frames();
  running.snapshot.requested = running.request.behavior.topics;
  running.snapshot.nodes = nodesNow(running.heard);
  behavior.snapshot = running.snapshot.toJson();
  // Held until it is in the list: interruptAll() ends this one, too.
  const std::lock_guard<std::mutex> lock(mutex_);
  lookAtClocks();
  behavior.id = store_.newBehaviorId();
  behavior.begin = rosNow();
  behavior.wall_begin = replay::wallNow();
  behavior = recorder_.begin(behavior, running.request.terms);
  ROS_INFO_STREAM("recording behavior " << behavior.id << " '" << behavior.name << "'");
  running_.emplace(behavior.id, std::move(running));
  return behavior.id;
}

void RecordingManager::lookForTopics() {
  std::map<std::int64_t, RecordingRequest> open;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [id, running] : running_) {
      if (running.request.choice.isOpen()) open[id] = running.request;
    }
  }
  // askTopicTypes() throws where no master answers; the listener would wait for one while locked.
  listener_.renew(askTopicTypes(deadlineIn(1.0)));
  for (const auto& [id, request] : open) {
    const std::vector<std::string> topics = topicsNow(request);
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = running_.find(id);
    if (found == running_.end()) continue;
    std::vector<std::string>& known = found->second.topics;
    std::vector<std::string> added;
    std::copy_if(topics.begin(), topics.end(), std::back_inserter(added),
                 [&](const std::string& topic) {
                   return std::find(known.begin(), known.end(), topic) == known.end();
                 });
    if (added.empty()) continue;
    recorder_.addTopics(id, added);
    known.insert(known.end(), added.begin(), added.end());
    added = withAnswers(added);
    listener_.acquire(added);
    found->second.heard.insert(found->second.heard.end(), added.begin(), added.end());
  }
}

// ---------------------------------------------------------------------------------------- ending

std::optional<RecordingManager::Ended> RecordingManager::stop(std::int64_t id,
                                                              const std::string& outcome,
                                                              const std::string& forced_by) {
  Running running;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = running_.find(id);
    if (found == running_.end()) {
      return takeCutShort(id);
    }
    running = std::move(found->second);
    running_.erase(found);
  }
  letMessagesArrive();
  const Ended ended = end(id, running, outcome, forced_by);
  listener_.release(running.heard);
  for (const std::string& remark : ended.counts.remarks) {
    ROS_WARN_STREAM("behavior " << id << ": " << remark);
  }
  if (ended.kept && !ended.counts.silent_topics.empty()) {
    ROS_WARN_STREAM("behavior " << id << ": nothing on "
                                << fmt::format("{}", fmt::join(ended.counts.silent_topics, ", ")));
  }
  if (running.on_end) {
    running.on_end(id, ended);
  } else if (!forced_by.empty()) {
    const std::lock_guard<std::mutex> lock(mutex_);
    cut_short_[id] = ended;
  }
  return ended;
}

std::optional<RecordingManager::Ended> RecordingManager::takeCutShort(std::int64_t id) {
  const auto found =
      id == 0 && !cut_short_.empty() ? std::prev(cut_short_.end()) : cut_short_.find(id);
  if (found == cut_short_.end()) {
    return std::nullopt;
  }
  const Ended ended = found->second;
  cut_short_.erase(found);
  return ended;
}

RecordingManager::Ended RecordingManager::end(std::int64_t id, const Running& running,
                                              const std::string& outcome,
                                              const std::string& forced_by) {
  const std::set<std::string>& keep_if = running.request.keep_if;
  Ended ended;
  ended.outcome = outcome;
  ended.kept = keep_if.empty() || keep_if.count(outcome) != 0 || !forced_by.empty();
  ended.topics = running.topics;
  ended.problem = forced_by;
  ended.counts = recorder_.counts(id);  // in case the store fails
  std::vector<std::string> remarks;
  lookAtClocks();
  const auto unsent = store_.holdSending();
  try {
    ended.counts =
        recorder_.end(id, rosNow(), [&](replay::Behavior& behavior, const auto& references) {
          remarks.clear();  // the store may have been busy before
          complete(running, outcome, behavior, references, remarks);
        });
    ended.counts.remarks.insert(ended.counts.remarks.end(), remarks.begin(), remarks.end());
    if (!ended.kept) {
      recorder_.discard(id);
      ended.counts.stored = 0;
    }
  } catch (const replay::StoreError& error) {
    ended.problem = error.what();
  }
  ended.problem = recorder_.failure().value_or(ended.problem);
  return ended;
}

void RecordingManager::complete(const Running& running, const std::string& outcome,
                                replay::Behavior& behavior, const std::set<std::string>& references,
                                std::vector<std::string>& remarks) {
  replay::Snapshot snapshot = running.snapshot;
  snapshot.end = world_.frames();
  snapshot.robot = world_.robot();  // tf may have come only now
  // A map that is being made is another one all the time.
  if (snapshot.map != world_.map()) snapshot.map.clear();
  snapshot.files = keepFiles(store_.local(), references, options_.file_roots, remarks);
  noteNodes(running, snapshot.nodes);
  behavior.outcome = outcome;
  behavior.snapshot = snapshot.toJson();
  behavior.remarks.insert(behavior.remarks.end(), remarks.begin(), remarks.end());
}

void RecordingManager::noteNodes(const Running& running, replay::RecordedNodes& nodes) const {
  addNodes(nodes, nodesNow(running.heard));
  for (const std::string& topic : running.heard) {
    const std::set<std::string> senders = listener_.senders(topic);
    if (!senders.empty()) nodes[topic].publishers = senders;  // others only announced it
  }
}

void RecordingManager::interruptAll(const std::string& reason) {
  for (const std::int64_t id : runningIds()) {
    stop(id, kInterrupted, reason);
  }
}

std::vector<std::int64_t> RecordingManager::runningIds() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::int64_t> ids;
  for (const auto& [id, running] : running_) {
    ids.push_back(id);
  }
  return ids;
}

// -------------------------------------------------------------------------------------- watching

void RecordingManager::lookAtClocks() {
  const auto steady = std::chrono::steady_clock::now().time_since_epoch();
  recorder_.look({rosNow(), replay::wallNow(),
                  std::chrono::duration_cast<std::chrono::nanoseconds>(steady).count(),
                  !ros::Time::isSystemTime()});
}

void RecordingManager::watch() {
  for (const std::string& text : recorder_.takeNotices()) {
    ROS_WARN_STREAM(text);
  }
  tellDrops();
  const replay::DiskState state = space_.disk();
  std::optional<std::string> problem = recorder_.failure();
  if (!problem && state.level == replay::DiskState::Level::Full) {
    problem = state.text;
  }
  if (state.level == replay::DiskState::Level::Low) {
    ROS_WARN_STREAM_THROTTLE(60, state.text);
  }
  if (!problem) {
    return;
  }
  for (const std::int64_t id : runningIds()) {
    ROS_ERROR_STREAM("behavior " << id << " is cut short: " << *problem);
  }
  interruptAll(*problem);
}

std::map<std::string, std::uint64_t> RecordingManager::namedCounts() const {
  std::map<std::string, std::uint64_t> named;
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& [id, running] : running_) {
    const auto stored = recorder_.counts(id).stored_on;
    for (const std::string& topic : running.request.behavior.topics) {
      const auto found = stored.find(topic);
      named["behavior " + std::to_string(id) + " " + topic] =
          found == stored.end() ? 0 : found->second;
    }
  }
  return named;
}

void RecordingManager::tellDrops() {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (auto& [id, running] : running_) {
    const std::uint64_t dropped = recorder_.counts(id).dropped;
    if (dropped > running.dropped_told) {
      ROS_WARN_STREAM("behavior " << id << ": " << dropped - running.dropped_told
                                  << " messages were dropped, " << dropped << " in all");
      running.dropped_told = dropped;
    }
  }
}

}  // namespace afterglow::nodes
