/// \file
/// The robot's joints by its description, the one that was recorded with a behavior or today's, and
/// who tells where they are.
///
/// The positions of the robot's joints now: /joint_states, or where a robot with a namespace has
/// it.
#pragma once

#include <sensor_msgs/JointState.h>

#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "nodes/tools/callback_thread.hpp"
#include "replay/clock/clock.hpp"
#include "replay/motion/arm/arm_start.hpp"
#include "replay/motion/robot_joints.hpp"
#include "replay/motion/silence_monitor.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/plan/robot_profile.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Reads joints from a URDF. Of no joint if the text is none.
replay::RobotJoints readRobotJoints(const std::string& urdf, const replay::RobotProfile& robot);

/// The URDF that was recorded with the behavior; empty without one. Throws StoreError.
std::string recordedDescription(const replay::Store& store, const replay::Behavior& behavior);

/// Reads joints from the description that was recorded with the behavior; no joint without one.
/// Throws StoreError.
replay::RobotJoints recordedJoints(const replay::Store& store, const replay::Behavior& behavior,
                                   const replay::RobotProfile& robot);
/// Reads joints from robot_description on the parameter server now, as the robot in that namespace
/// has it; no joint without one.
replay::RobotJoints liveDescription(const std::string& name_space,
                                    const replay::RobotProfile& robot);

/// The recorded topics of a type that are called like one of the robot's: "/joint_states" and
/// "/fetch7/joint_states", but for those outside of its namespace; if there is none, `usual` as the
/// robot has it. Throws StoreError.
std::vector<std::string> recordedTopics(const replay::Store& store,
                                        const replay::Behavior& behavior,
                                        const std::vector<std::string>& types,
                                        const std::string& usual);
/// Returns that topic's name on today's robot: renamed as all topics of the plan are, unless the
/// plan plays it, so that it would hear itself.
std::string liveName(const replay::PlayPlan& plan, const replay::PlanOptions& names,
                     const std::string& recorded);

/// Listens while it lives, in a thread of its own. Each message may have some of the joints. Any
/// thread.
class LiveJoints {
 public:
  /// Listens to one topic or several, each with some of the joints.
  explicit LiveJoints(const std::vector<std::string>& topics = {"/joint_states"});

  /// Empty if nobody has told of this joint, or has fallen silent, in the robot's time.
  std::optional<replay::LiveJoint> find(const std::string& joint) const;
  /// Calls `on_silence` from now on, in the thread of its own, when a joint that is told of falls
  /// silent while it moves, by `moving`.
  void watch(std::function<std::vector<std::string>()> moving,
             std::function<void(const std::string& reason)> on_silence);
  /// Returns the positions of all joints in any message so far.
  std::map<std::string, double> positions() const;

 private:
  struct Told {
    replay::LiveJoint joint;
    replay::SilenceMonitor watch{replay::kJointSilence};  ///< watch by robotNow()
  };
  void onJoints(const sensor_msgs::JointState& message);

  mutable std::mutex mutex_;
  std::map<std::string, Told> joints_;
  ros::SteadyTimer timer_;  ///< watch()'s
  CallbackThread thread_;
};

}  // namespace afterglow::nodes
