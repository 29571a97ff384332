/// \file
/// The demo's scenario as its YAML files give it: the room, and the three behaviors with their
/// poses, durations and sentences. Metres, radians, seconds (the files say degrees).
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "nodes/kitting/kitting_path.hpp"
#include "nodes/kitting/kitting_world.hpp"

namespace afterglow::nodes {

/// How long each motion of a behavior is to take, by name.
using Durations = std::map<std::string, double>;

struct PickPlan {
  std::vector<std::string> recognized;  ///< things shown in white
  std::string grasped;                  ///< the thing shown in green and taken
  double point_spacing = 0;
  double torso = 0;
  double grasp_yaw = 0, grasp_height = 0;  ///< about the thing's vertical; over where it stands
  double approach = 0, lift = 0;           ///< above the grasp
  double gap = 0;                          ///< between the fingers when they hold it
  std::string says;
  Durations seconds;  ///< look, reach, descend, close, lift, retreat
};

struct DrivePlan {
  PlanarPose goal;
  double clearance = 0;
  DriveLimits limits;
  double command_hz = 0, scan_hz = 0;
  double path_seconds = 0, aim_seconds = 0;  ///< between two sendings of the path, two aimings
  double aim_widest = 0;                     ///< the light points no further to the side than this
  double aim_ahead = 0;                      ///< m along the path
  double head_tilt = 0;
  double perceive = 0;    ///< seconds it looks before it drives
  double says_after = 0;  ///< seconds into the behavior
  std::string says;
  PathMarkerStyle arrows;
};

struct PlacePlan {
  std::string caddy;
  Eigen::Vector2d section = Eigen::Vector2d::Zero();  ///< center, in the caddy's frame
  Eigen::Vector3d cube = Eigen::Vector3d::Ones();
  double torso = 0;
  double grasp_yaw = 0;              ///< in the caddy's frame
  double approach = 0, release = 0;  ///< gripper over where the caddy stands
  double floor = 0;                  ///< of the section, over where the caddy stands
  std::string says;
  Durations seconds;  ///< lift_torso, look, reach, lower, open, raise, retreat
};

struct KittingPlan {
  std::string voice;
  double speech_seconds = 0;  ///< a behavior ends no sooner after its sentence began
  double gripper_open = 0;
  double settle = 0;
  Eigen::Vector3d carry = Eigen::Vector3d::Zero();  ///< gripper between two motions, base_link
  double carry_torso = 0;
  PickPlan pick;
  DrivePlan drive;
  PlacePlan place;
};

/// Both throw std::runtime_error "FILE:LINE: what is wrong".
KittingPlan loadKittingPlan(const std::string& path);
World loadRoom(const std::string& path);

/// Topics of every behavior, as the paper's sample code records them.
const std::vector<std::string>& kittingTopics();

}  // namespace afterglow::nodes
