/// \file
/// A recorded drive, driven again by a BaseTracker and a SimulatedDrive.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>

#include "replay/motion/base/base_tracker.hpp"
#include "tests/support/simulated_drive.hpp"

namespace afterglow::test {

inline constexpr LocalizationFaults kExact{0, 0, 0};

/// A replay, 33 commands a second, by a robot whose odometry has an origin of its own.
struct Replay {
  const RecordedDrive& recorded;
  replay::BaseTracker tracker;
  SimulatedDrive robot;
  SimulatedLocalization seen;
  int steps = 0;
  double largest = 0;  ///< m off the recorded drive, at the progress reached
  replay::PlanarVelocity command;
  /// Called before each command.
  std::function<void(double now, replay::BaseInput&)> disturb = [](double, replay::BaseInput&) {};

  Replay(const RecordedDrive& drive, const replay::TrackerOptions& options,
         const replay::PlanarPose& start_error = {}, const DriveFaults& faults = {},
         const LocalizationFaults& localization = kExact, std::uint32_t seed = 1)
      : recorded(drive),
        tracker(drive.track, options),
        robot(compose(drive.start, start_error), {5, -3, 2}, faults, seed),
        seen(localization, seed + 1) {}

  double now() const { return steps * kStep; }
  bool isOver() const {
    return tracker.state() == replay::BaseState::Done || tracker.state() == replay::BaseState::Lost;
  }

  void step() {
    const auto pose = seen.look(now(), robot);
    if (steps % 3 == 0) {
      replay::BaseInput input{stampAt(now()), replay::StampedPose{stampAt(now()), robot.odometry()},
                              pose};
      disturb(now(), input);
      command = tracker.update(input);
      robot.command(now(), command);
    }
    robot.step(now());
    ++steps;
    const auto at = static_cast<std::size_t>(
        replay::secondsBetween(recorded.track.begin(), tracker.progress()) / kStep);
    const replay::PlanarPose& should = recorded.truth[std::min(at, recorded.truth.size() - 1)];
    largest = std::max(largest, distance(robot.truth(), should));
  }
  void runUntil(double seconds) {
    while (now() < seconds && !isOver()) step();
  }
  /// To the end, and until it stands.
  void run() {
    runUntil(120);
    for (int i = 0; i < 50; ++i) step();
  }
  double endError() const { return distance(robot.truth(), recorded.end); }
  double endTurn() const {
    return std::abs(replay::wrapAngle(robot.truth().yaw - recorded.end.yaw));
  }
};

}  // namespace afterglow::test
