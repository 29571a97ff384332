/// \file
/// Starts and ends recordings: subscriptions, behaviors and their snapshots, without any action or
/// service; and keeps space on the disk for the behaviors that are still to be recorded.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "nodes/recorder/recorder_options.hpp"
#include "nodes/recorder/recording_request.hpp"
#include "nodes/recorder/topic_listener.hpp"
#include "nodes/recorder/world_snapshot.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/record/disk_guard.hpp"
#include "replay/record/recorder.hpp"
#include "replay/store/open/recorder_store.hpp"

namespace afterglow::nodes {

/// Any thread. Options and store must outlive it.
class StoreSpace {
 public:
  StoreSpace(const RecorderNodeOptions& options, replay::RecorderStore& store);

  /// Judged by ~min_space; Ample if the system does not say.
  replay::DiskState disk() const;
  /// Removes old behaviors as ~retention_days and ~retention_gigabytes say, on a server too, and
  /// from this machine what a server has. To be called now and then; warns of what fails.
  void makeRoom();

 private:
  const RecorderNodeOptions& options_;
  replay::RecorderStore& store_;
  const std::string folder_;  ///< folder in which the recorder's file grows
};

/// Any number of behaviors at once. A behavior counts as started when every publisher that was
/// announced on its topics is known to send here; one that does not in time is named in a warning.
/// Topics without publishers are listened to all the same. Any thread.
class RecordingManager {
 public:
  struct Ended {
    replay::RecordedCounts counts;
    std::string outcome;
    std::vector<std::string> topics;
    bool kept = true;
    std::string problem;  ///< the reason why the recording is not whole; empty if it is
  };
  /// Told once, by whatever thread ends the behavior.
  using OnEnd = std::function<void(std::int64_t id, const Ended&)>;

  /// Throws StoreError. All three must outlive it.
  RecordingManager(const RecorderNodeOptions& options, replay::RecorderStore& store,
                   const StoreSpace& space);
  ~RecordingManager();

  /// Returns when the recording runs, with its id. Throws std::runtime_error, one line; also where
  /// time stands (requireTime()), as all stamps would be one.
  std::int64_t start(const RecordingRequest& request, const OnEnd& on_end, std::string* warning);
  /// Empty if it does not run. `forced_by` is the reason of an end that no caller asked for; the
  /// first caller to stop it later (0: the last one) gets its result, unless on_end got it.
  std::optional<Ended> stop(std::int64_t id, const std::string& outcome,
                            const std::string& forced_by = {});
  /// Ends waiting for a busy store from now on.
  void hurry() { recorder_.hurry(); }
  /// Ends all running recordings with the outcome "interrupted".
  void interruptAll(const std::string& reason);
  std::vector<std::int64_t> runningIds() const;
  replay::RecordedCounts counts(std::int64_t id) const { return recorder_.counts(id); }
  replay::RecorderLoad load() const { return recorder_.load(); }
  /// Returns how many messages were stored on each topic that a running behavior's request named,
  /// by "behavior ID TOPIC".
  std::map<std::string, std::uint64_t> namedCounts() const;
  std::optional<std::string> failure() const { return recorder_.failure(); }

  /// Looks for topics often (~rescan): those that turned up join the behaviors that want them, and
  /// topics whose type changed are heard again.
  void lookForTopics();
  /// Looks at the clocks about ten times a second.
  void lookAtClocks();
  /// Watches once a second: logs what was dropped, and ends all recordings when the store fails or
  /// the disk is full.
  void watch();

 private:
  struct Running {
    RecordingRequest request;
    std::vector<std::string> topics;  ///< the behavior's own topics
    std::vector<std::string> heard;   ///< acquired for it: those, its goals' results and cancels
    replay::Snapshot snapshot;
    OnEnd on_end;
    std::uint64_t dropped_told = 0;
  };

  std::vector<std::string> topicsNow(const RecordingRequest& request) const;
  /// Returns old links of topics that are not listened to: connections that their publishers
  /// believe in.
  Links oldLinks(const std::vector<std::string>& topics) const;
  std::int64_t begin(Running running);
  void complete(const Running& running, const std::string& outcome, replay::Behavior& behavior,
                const std::set<std::string>& references, std::vector<std::string>& remarks);
  /// Notes who sent until now, and who hears it now.
  void noteNodes(const Running& running, replay::RecordedNodes& nodes) const;
  Ended end(std::int64_t id, const Running& running, const std::string& outcome,
            const std::string& forced_by);
  std::optional<Ended> takeCutShort(std::int64_t id);
  void tellDrops();

  const RecorderNodeOptions& options_;
  replay::RecorderStore& store_;
  const StoreSpace& space_;
  replay::Recorder recorder_;
  TopicListener listener_;
  WorldSnapshot world_;

  std::mutex subscribing_mutex_;  ///< old connections are listed before new ones are made
  mutable std::mutex mutex_;
  std::map<std::int64_t, Running> running_;
  std::map<std::int64_t, Ended> cut_short_;  ///< forced ends that no caller has heard of yet
};

}  // namespace afterglow::nodes
