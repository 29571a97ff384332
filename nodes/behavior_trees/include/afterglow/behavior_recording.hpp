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

#include "afterglow/recorder_client.hpp"

namespace afterglow::nodes {

/// The recording of one behavior. A thread asks the recorder, for all recordings of this process
/// one after the other in the order in which they were made and ended, so that an attempt never
/// overlaps the one before it, and a recording ends after those below it. Waiting for that thread
/// is bounded by the options' timeout, so that a slow recorder does not stall a robot. While the
/// answer to a start is overdue, that recorder gets no further recordings.
///
/// Move-only; used by one thread at a time. Not to be kept beyond ROS's shutdown: its end would not
/// reach the recorder.
class BehaviorRecording {
 public:
  /// Begins a recording; with options.wait it returns when the recording has started, or has failed
  /// to. Throws std::runtime_error if it has failed and options.required is set (with options.wait
  /// only).
  explicit BehaviorRecording(RecordingOptions options,
                             std::shared_ptr<RecorderClient> recorder = rosRecorder());
  /// Ends the recording, if it has not ended: as "exception" while an exception is thrown, else as
  /// "stopped". Waits for the recorder's answer.
  ~BehaviorRecording();
  BehaviorRecording(BehaviorRecording&&) noexcept = default;
  /// Ends and waits for what was recorded here, as the destructor does.
  BehaviorRecording& operator=(BehaviorRecording&& other) noexcept;

  void succeed() { end("success"); }
  void fail() { end("failure"); }
  /// Ends the recording with any outcome; does not wait. Only the first end counts.
  void end(const std::string& outcome);

  /// The recording has started, or is not waited for any longer.
  bool isSettled() const;
  /// The recorder has answered all requests, or gets none.
  bool isDone() const;
  /// The behavior's id in the store; 0 until the recording has started.
  std::int64_t id() const;
  /// Returns why there is no recording (yet); empty if all is well.
  std::string problem() const;
  const std::string& treePath() const;
  /// Different for every recording of this process.
  std::uint64_t serial() const;

 private:
  struct State;
  class Requests;
  void finish() noexcept;

  std::shared_ptr<State> state_;
  int exceptions_ = 0;  ///< exceptions in flight when the recording was made
};

/// While it lives, recordings that this thread makes without a tree path lie below `recording`,
/// which must outlive it and not be moved.
class EnclosingRecording {
 public:
  explicit EnclosingRecording(const BehaviorRecording& recording);
  ~EnclosingRecording();
  EnclosingRecording(const EnclosingRecording&) = delete;
  EnclosingRecording& operator=(const EnclosingRecording&) = delete;

  /// The serial of this thread's innermost enclosing recording; 0: there is none.
  static std::uint64_t current();

 private:
  const BehaviorRecording* outer_;
};

}  // namespace afterglow::nodes
