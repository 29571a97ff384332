/// \file
/// Recordings of the nodes of an observed behavior tree, for any tree library.
#pragma once

#include <afterglow/TreeTransition.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "afterglow/behavior_recording.hpp"

namespace afterglow::nodes {

/// Records every node whose path matches and that no earlier rule matches.
struct RecordRule {
  /// A glob: `?` is a character, `*` any but "/", `**` any, `**/` any number of names. Or, if it
  /// begins with "^", a regular expression (ECMAScript). Either must match the whole path.
  std::string path;
  /// Empty name, path and attempt are the node's. `required` is ignored, because an observer
  /// changes no tree. With `wait` the node is delayed when it begins, so that its first messages
  /// are recorded; the library announces actions only after their first tick: add a pre-roll for
  /// them.
  RecordingOptions recording = {};
};

using TransitionSink = std::function<void(const TreeTransition&)>;

struct TreeWatchOptions {
  std::string tree = {};  ///< the tree's name; empty: its root's
  std::vector<RecordRule> record = {};
  std::shared_ptr<RecorderClient> recorder = rosRecorder();
  TransitionSink publish = {};  ///< empty: publishTransitions()
};

/// Publishes on a topic of this node.
TransitionSink publishTransitions(const std::string& topic = "~tree_transitions");

struct WatchedNode {
  std::string name, type;
  std::uint32_t uid = 0;
  std::optional<std::size_t> parent;  ///< index, below the node's own; empty: root
};

/// Recordings of the nodes of one tree, by their status. Any thread.
class TreeWatch {
 public:
  /// The root comes first. Throws std::invalid_argument for a rule that is no pattern or that no
  /// node matches.
  TreeWatch(const std::vector<WatchedNode>& nodes, TreeWatchOptions options);

  /// Statuses are called IDLE, RUNNING, SUCCESS and FAILURE.
  void onTransition(std::size_t index, const std::string& from, const std::string& to);
  std::vector<std::string> paths() const;

 private:
  struct Node {
    std::string name, type, path;
    std::uint32_t uid = 0;
    std::optional<std::size_t> parent;
    const RecordRule* rule = nullptr;
    std::chrono::steady_clock::time_point since;
    int failures = 0;
    std::optional<BehaviorRecording> recording;
  };

  void chooseNodes();
  void begin(Node& node, bool wait);
  void end(Node& node, const std::string& outcome);
  std::int64_t behaviorOf(std::size_t index) const;
  void publish(std::size_t index, const std::string& from, const std::string& to);

  const TreeWatchOptions options_;
  std::mutex mutex_;
  std::vector<Node> nodes_;
  std::vector<BehaviorRecording> ending_;  ///< recordings whose recorder has not answered yet
};

}  // namespace afterglow::nodes
