/// \file
/// How the robot stands now: joint states and tf.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "replay/motion/start_pose.hpp"

namespace afterglow::nodes {

struct PoseQuestion {
  std::vector<std::string> joints;
  bool asks_base = false;
  std::string map = "map", base = "base_link";  ///< its frames
};

/// All joints that /joint_states tells of, and the base, if asked. Waits for those that are asked
/// for, at most so long or until `is_stopped`; what is not known then is left out.
replay::StartPose askLivePose(const PoseQuestion& question, double patience_s,
                              const std::function<bool()>& is_stopped);

}  // namespace afterglow::nodes
