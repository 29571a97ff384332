/// \file
/// All by which people stop a replay in motion: an emergency stop, a button that has to be held,
/// and driving the robot themselves.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "nodes/player/emergency_stop.hpp"
#include "nodes/player/hold_button.hpp"
#include "nodes/player/take_over.hpp"
#include "replay/plan/play_plan.hpp"

namespace afterglow::nodes {

/// ROS parameters of the same meaning are named in brackets.
struct StopOptions {
  EmergencyStopOptions emergency_stop;  ///< [~estop_topic, ~estop_longest_silence]
  HoldButtonOptions hold_button;        ///< [~hold_to_run]
};

/// Returns the topic of the base's velocities: the topic that was named, the profile's, or the only
/// velocity topic that is played; empty: it is not known which, or the base is not driven.
std::string baseTopic(const replay::PlayPlan& plan, const std::string& named,
                      const std::string& of_profile);

/// The inputs that stop one replay.
class StopInputs {
 public:
  /// Any thread. `stop`: for good. `halt`: until it is called with false.
  struct Actions {
    std::function<void(const std::string& reason)> stop;
    std::function<void(bool halts)> halt;
  };
  /// The take-over, which has to know what is sent from the first message on, outlives it.
  StopInputs(const StopOptions& options, TakeOver& take_over, Actions actions);
  ~StopInputs();

  /// Checks before anything moves. Throws std::runtime_error, one line, if the robot may not.
  void check();
  /// Waits for the button, if there is one; throws as HoldButton::waitUntilHeld().
  void waitUntilHeld(const std::function<bool()>& is_stopped);
  /// Returns true if it is held, or need not be.
  bool isHeld() { return !hold_button_ || hold_button_->isHeld(); }
  /// Returns notes for the report.
  std::vector<std::string> notes() const;

 private:
  const StopOptions options_;
  TakeOver& take_over_;
  const Actions actions_;
  std::optional<EmergencyStop> emergency_stop_;
  std::optional<HoldButton> hold_button_;
};

}  // namespace afterglow::nodes
