/// \file
/// The recordings of one node of a behavior tree, one after the other, for any tree library.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "afterglow/behavior_recording.hpp"

namespace afterglow::nodes {

/// Waits only in its destructor: until the recorder has answered every end.
class RecordedNode {
 public:
  explicit RecordedNode(std::shared_ptr<RecorderClient> recorder);

  /// Returns true between begin() and end().
  bool isRunning() const { return running_.has_value(); }
  /// An attempt of 0 is counted: up from 1 with every failure, until a success, a halt, or a new
  /// run of the enclosing recorded behavior.
  void begin(RecordingOptions options);
  /// Returns true if the recording has started, or is not waited for (any longer).
  bool mayGo() const;
  /// Returns true if the recording is required and has failed.
  bool isRefused() const;
  const BehaviorRecording& running() const { return *running_; }
  /// Ends the recording; without one, only resets the count of attempts.
  void end(const std::string& outcome);

 private:
  const std::shared_ptr<RecorderClient> recorder_;
  bool waits_ = true, is_required_ = false;
  int failures_ = 0;
  std::uint64_t enclosing_ = 0;
  std::optional<BehaviorRecording> running_;
  std::vector<BehaviorRecording> ending_;  ///< recordings whose recorder has not answered yet
};

}  // namespace afterglow::nodes
