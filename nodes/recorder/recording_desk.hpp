/// \file
/// Where recordings are ordered and ended: subscriptions, behaviors and what goes with them,
/// without any action or service.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
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
#include "replay/store/mongo/spool_status.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// The outcome of a behavior that ends because recording does.
constexpr char kInterrupted[] = "interrupted";

replay::Stamp rosNow();
replay::Stamp wallNow();

/// Any number of behaviors at once. A behavior counts as started when every publisher that was
/// announced on its topics is known to send here; one that does not in time is named in a warning.
/// Topics without publishers are listened to all the same. Any thread.
class RecordingDesk {
 public:
  struct Ended {
    replay::RecordedCounts counts;
    std::string outcome;
    std::vector<std::string> topics;
    bool kept = true;
    std::string problem;  ///< why the recording is not whole; empty if it is
  };
  /// Told once, by whatever thread ends the behavior.
  using OnEnd = std::function<void(std::int64_t id, const Ended&)>;

  /// Throws StoreError.
  explicit RecordingDesk(const RecorderNodeOptions& options);
  ~RecordingDesk();

  /// Returns when the recording runs, with its id. Throws std::runtime_error, one line.
  std::int64_t start(const RecordingRequest& request, const OnEnd& on_end, std::string* warning);
  /// Empty if it does not run. `forced_by` says why if nobody asked for the end; who asks later
  /// (0: for the last one) is told once, unless on_end was.
  std::optional<Ended> stop(std::int64_t id, const std::string& outcome,
                            const std::string& forced_by = {});
  /// From now on nothing waits for a busy store.
  void hurry() { recorder_.hurry(); }
  /// Ends what runs as kInterrupted.
  void interruptAll(const std::string& reason);
  std::vector<std::int64_t> runningIds() const;
  replay::RecordedCounts counts(std::int64_t id) const { return recorder_.counts(id); }
  replay::RecorderLoad load() const { return recorder_.load(); }
  std::optional<std::string> failure() const { return recorder_.failure(); }
  replay::DiskState disk() const;
  /// Empty if the store writes without one.
  std::optional<replay::SpoolStatus> spool() const;

  /// To be called often (~rescan): topics that turned up join the behaviors that want them, and
  /// topics whose type changed are heard again.
  void lookForTopics();
  /// To be called about ten times a second.
  void lookAtClocks();
  /// To be called once a second: says what was dropped, and ends what can go on no longer.
  void watch();
  /// Old behaviors make room as the options say. To be called now and then; throws StoreError.
  void prune();

 private:
  struct Running {
    RecordingRequest request;
    std::vector<std::string> topics;  ///< its own
    std::vector<std::string> heard;   ///< acquired for it: those, and its goals' results
    replay::Snapshot snapshot;
    OnEnd on_end;
    std::uint64_t dropped_told = 0;
  };

  std::vector<std::string> topicsNow(const RecordingRequest& request) const;
  /// Of topics that are not listened to: connections that their publishers believe in.
  Links oldLinks(const std::vector<std::string>& topics) const;
  std::int64_t begin(Running running);
  void complete(const Running& running, const std::string& outcome, replay::Behavior& behavior,
                const std::set<std::string>& references, std::vector<std::string>& remarks);
  Ended end(std::int64_t id, const Running& running, const std::string& outcome,
            const std::string& forced_by);
  std::optional<Ended> takeCutShort(std::int64_t id);
  void tellDrops();

  const RecorderNodeOptions options_;
  const std::string folder_;  ///< the store's; empty if it is none of files here
  std::unique_ptr<replay::Store> store_;
  replay::Recorder recorder_;
  TopicListener listener_;
  WorldSnapshot world_;

  std::mutex subscribing_mutex_;  ///< whose connections are old is asked before there are new ones
  mutable std::mutex mutex_;
  std::map<std::int64_t, Running> running_;
  std::map<std::int64_t, Ended> cut_short_;  ///< nobody was told yet
};

}  // namespace afterglow::nodes
