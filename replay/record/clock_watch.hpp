/// \file
/// Notices that a clock was set: what recorded stamps mean changes there.
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

/// Looked at about ten times a second. Says when the wall clock left the steady one by more than
/// half a second since the last look, or a simulation's clock leapt ahead (by more than a second
/// beyond ten times real time). That ROS time went back is the recorder's to notice, by the
/// messages themselves.
class ClockWatch {
 public:
  /// One sentence with time and size; empty if all is well.
  std::optional<std::string> look(const ClockReading& now);

 private:
  std::optional<ClockReading> last_;
};

/// "3.250 s"; never in exponents.
std::string secondsText(std::int64_t ns);

}  // namespace afterglow::replay
