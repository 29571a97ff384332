/// \file
/// The controller that points the head, simulated. Semantics of robot_controllers' PointHead
/// (melodic-devel), with its fault: after a cancel (issue 33) the time of a turn has run out before
/// it begins, so the head jumps to its target.
#pragma once

#include <utility>
#include <vector>

#include "nodes/fetch/joint_controller.hpp"

namespace afterglow::nodes {

class HeadPointer : public JointController {
 public:
  /// Pan, then tilt.
  explicit HeadPointer(std::vector<Joint> joints) : JointController(std::move(joints)) {}

  struct Turn {
    std::vector<double> angles;  ///< of pan and tilt, beyond their limits if need be
    Nanoseconds min_duration{0};
    double max_velocity = 0;  ///< 0: the joints'; the mean over the turn, its peak is above
  };
  /// From where the head is, from rest to rest. It succeeds when its time is over, wherever the
  /// head is then.
  void start(const Turn& turn, const JointStates& measured, Nanoseconds now);

 private:
  void judge(const JointStates& measured, Nanoseconds now) override;
};

}  // namespace afterglow::nodes
