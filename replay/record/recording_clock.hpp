/// \file
/// The stamps of a recording, and the sentences about clocks that were set: the meaning of recorded
/// stamps changes there.
#pragma once

#include <optional>
#include <string>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// The three clocks at one moment, nanoseconds. ROS time is the wall's or, simulated, /clock's.
struct ClockReading {
  Stamp ros, wall;
  std::int64_t steady_ns = 0;
  bool is_simulated = false;
};

/// Gives stamps that never go back within one recording of the store. Not thread-safe.
class RecordingClock {
 public:
  struct Given {
    Stamp stamp;
    std::optional<std::string> jump;  ///< a sentence, if ROS time was set
  };

  /// The stamp of an event at this ROS time. If ROS time was set by more than half a second (less
  /// is evened out), back, or ahead of the steady clock (`steady_ns`, unless ROS time is a
  /// simulation's), stamps go on by the steady clock while behaviors run (`is_recording`), without
  /// one from the last stamp, the clock's differences kept. Otherwise they begin again at the
  /// clock's time.
  Given stamp(Stamp ros, bool is_recording, std::optional<std::int64_t> steady_ns = {});
  Stamp last() const { return last_; }  ///< no later stamp was given
  /// Returns true if ROS time went back since beginRecording(): the next stamps need a new
  /// recording.
  bool wentBack() const { return went_back_; }
  void beginRecording() { went_back_ = false; }
  /// Ends the recording when no behavior runs any more: stamps are ROS time again. True if they
  /// were ahead of it until now.
  bool endRecording();

  /// Looks at the clocks about ten times a second. One sentence with time and size when the wall
  /// clock left the steady one by more than half a second since the last call, or a simulation's
  /// clock leapt ahead (by more than a second beyond ten times real time) or has stood still for
  /// five seconds.
  std::optional<std::string> look(const ClockReading& now);

 private:
  Stamp last_;
  std::int64_t ahead_ns_ = 0;  ///< difference by which stamps are ahead of ROS time
  bool went_back_ = false;
  std::optional<std::int64_t> leapOf(Stamp ros, std::int64_t steady_ns);

  std::optional<ClockReading> last_reading_;
  std::int64_t standing_ns_ = 0;  ///< time for which a simulation's clock has not gone on
  /// ROS time less the steady clock, and what was seen once below that.
  std::optional<std::int64_t> ros_by_steady_ns_, lower_ns_;
};

}  // namespace afterglow::replay
