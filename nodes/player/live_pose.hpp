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
  replay::TrackFrames frames;  ///< its own, as they are called now
  std::vector<std::string> joint_topics = {"/joint_states"};
};

/// All joints on these topics, and the base if the question asks for it. Waits for the parts that
/// are asked for, at most `patience_s` or until `is_stopped`; parts that are unknown then are left
/// out.
replay::StartPose askLivePose(const PoseQuestion& question, double patience_s,
                              const std::function<bool()>& is_stopped);

}  // namespace afterglow::nodes
