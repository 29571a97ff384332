/// \file
/// Records a piece of code as a behavior, from construction to destruction. Needs roscpp only.
///
///     afterglow::nodes::BehaviorRecording recording({"pick", {"/tf", "/gripper/command"}});
///     if (pick()) {
///       recording.succeed();
///     } else {
///       recording.fail();
///     }
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "afterglow/recorder_client.hpp"

namespace afterglow::nodes {

/// The recording of one behavior. Starting and stopping are a thread's work; waiting for it is
/// bounded by the options' timeout, so that no recorder, however slow, stalls a robot. A recording
/// starts only when the recorder has answered all that this process asked before, so that an
/// attempt never overlaps the one before it, and ends only after those below it. While an answer to
/// a start is overdue nothing further is asked of that recorder.
///
/// Move-only; used by one thread at a time. Not to be kept beyond ROS's shutdown: its end would not
/// reach the recorder.
class BehaviorRecording {
 public:
  /// With options.wait it returns when the recording stands, or when it is known not to. Throws
  /// std::runtime_error if that is so and options.required is set (with options.wait only).
  explicit BehaviorRecording(RecordingOptions options,
                             std::shared_ptr<RecorderClient> recorder = rosRecorder());
  /// Ends it, if it has not ended: "exception" if that is why we are here, else "stopped". Waits
  /// for the recorder's answer.
  ~BehaviorRecording();
  BehaviorRecording(BehaviorRecording&&) noexcept = default;
  /// Ends and waits for what was recorded here, as the destructor does.
  BehaviorRecording& operator=(BehaviorRecording&& other) noexcept;

  void succeed() { end("success"); }
  void fail() { end("failure"); }
  /// Ends it with any word; does not wait. The first end counts.
  void end(const std::string& outcome);

  /// The recording stands, or nobody waits for it any longer.
  bool isSettled() const;
  /// The recorder has answered everything, or will not be asked.
  bool isDone() const;
  /// 0 as long as there is none.
  std::int64_t id() const;
  /// Why there is no recording (yet); empty if all is well.
  std::string problem() const;
  const std::string& treePath() const;
  /// Different for every recording of this process.
  std::uint64_t serial() const;

 private:
  struct State;
  class Registry;
  using States = std::vector<std::shared_ptr<State>>;
  void finish() noexcept;

  std::shared_ptr<State> state_;
  std::thread thread_;
  int exceptions_ = 0;  ///< in flight when the recording was made
};

/// While it lives, recordings that this thread makes without a tree path lie below this one, which
/// outlives it in its place.
class EnclosingRecording {
 public:
  explicit EnclosingRecording(const BehaviorRecording& recording);
  ~EnclosingRecording();
  EnclosingRecording(const EnclosingRecording&) = delete;
  EnclosingRecording& operator=(const EnclosingRecording&) = delete;

  /// The innermost one's serial of this thread; 0: none.
  static std::uint64_t current();

 private:
  const BehaviorRecording* outer_;
};

}  // namespace afterglow::nodes
