/// \file
/// The way of joints to where a motion begins, when they are elsewhere. A short way they go
/// straight; a longer one by the poses that the robot was recorded at, on its way there or from
/// there on, which it goes back, or straight if somebody who knows the room finds that free; else
/// straight only if that was allowed, as nobody knows what stands in between. No way is longer than
/// the bounds.
/// Radians, meters and seconds.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "replay/motion/arm/start_pose.hpp"
#include "replay/motion/joint_track.hpp"
#include "replay/motion/motion_limits.hpp"
#include "replay/motion/pose_track.hpp"
#include "replay/motion/robot_joints.hpp"

namespace afterglow::replay {

/// The peak velocity of a way from rest to rest, as controllers interpolate it (cubic), over its
/// mean.
constexpr double kCubicPeak = 1.5;
/// The longest time between the begin of a recorded way and the motion that it leads to, and
/// between a motion and the end of a way that is gone back.
constexpr std::int64_t kLongestRecordedWayNs = 120'000'000'000;

struct ApproachBounds {
  /// A joint goes so far straight, whatever was recorded.
  double free_turning = 0.2, free_sliding = 0.02;
  /// The longest way of a joint, and of all joints that turn, together.
  double turning = 3.2, sliding = 0.4, all_turning = 8;
};

/// No such way is known, or it is too long. One line that names the joint and what helps.
struct ApproachRefused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Through these poses, one number a joint, with a rest at each.
struct JointWay {
  enum class Kind { Short, Recorded, Checked, Unchecked };
  struct Rest {
    std::vector<double> positions;
    double at_s = 0;  ///< since the first
  };

  Kind kind = Kind::Short;
  std::vector<Rest> rests;

  double seconds() const { return rests.empty() ? 0 : rests.back().at_s; }
};

/// Returns why joints may not be at these positions; empty: they may.
using PoseCheck = std::function<std::string(const std::vector<std::string>& joints,
                                            const std::vector<double>& positions)>;

/// A value; reading it is safe from any thread.
class Approach {
 public:
  struct Rules {
    ApproachSpeed speed;  ///< or as fast as the limits allow, if that is slower
    MotionLimits limits;
    bool accepts_unchecked = false;
    RobotJoints robot;
    StartTolerances tolerances;  ///< tolerances of where the base stands
  };

  /// `recorded`: what was recorded until the motions begin. `base`: where the base stood; empty:
  /// the robot has none.
  Approach(JointTrack recorded, std::optional<PoseTrack> base, Rules rules)
      : recorded_(std::move(recorded)), base_(std::move(base)), rules_(std::move(rules)) {}

  const JointTrack& recorded() const { return recorded_; }
  /// Returns the way from `from` to `to`, where these joints were at the recorded moment. A
  /// recorded way ends there, or begins there and is gone back, the shorter of both; it is at most
  /// two minutes long, and the base stood on it where it stood at that moment.
  /// `check`, if there is one, is asked along a long way that was not recorded. Throws
  /// ApproachRefused.
  JointWay wayTo(const std::vector<std::string>& joints, const std::vector<double>& from,
                 const std::vector<double>& to, Stamp at, const PoseCheck& check = {}) const;

 private:
  using Pose = std::vector<double>;
  using Names = std::vector<std::string>;
  double speedOf(const std::string& joint) const;
  double shareOfFree(const Names& joints, const Pose& from, const Pose& to) const;
  std::optional<Pose> recordedPose(const Names& joints, Stamp at, const Pose& near) const;
  enum class Search { Before, After };
  std::vector<Pose> recordedPoses(const Names& joints, const Pose& from, const Pose& to, Stamp at,
                                  Search search) const;
  std::optional<JointWay> recordedWay(const Names& joints, const Pose& from, const Pose& to,
                                      Stamp at) const;
  bool hasBaseMoved(Stamp then, Stamp at) const;
  void checkBounds(const Names& joints, const JointWay& whole) const;
  double secondsFor(const Names& joints, const Pose& from, const Pose& to, bool is_whole) const;
  JointWay timed(const Names& joints, const std::vector<Pose>& poses, JointWay::Kind kind) const;
  void checkStraight(const Names& joints, const Pose& from, const Pose& to,
                     const PoseCheck& check) const;
  [[noreturn]] void refuseUnchecked(const Names& joints, const Pose& from, const Pose& to) const;

  JointTrack recorded_;
  std::optional<PoseTrack> base_;
  Rules rules_;
  ApproachBounds bounds_;
};

/// A goal that takes joints to where a behavior begins.
struct StartGoal {
  Bytes bytes;
  JointWay::Kind kind = JointWay::Kind::Short;  ///< kind of way; a gripper has Short alone
};

/// Made of the topic's first goal; brings its joints from `now`, its first point, to `then`, the
/// pose at the recorded moment. Empty if either position of a joint is unknown, or if no joint
/// deviates. `id`: of the new goal. Throws ApproachRefused, and MessageError for a goal of another
/// shape.
std::optional<StartGoal> startGoal(const JointGoals& goals, const StartPose& then,
                                   const StartPose& now, const StartTolerances& tolerances,
                                   const Approach& approach, Stamp at, const std::string& id,
                                   const PoseCheck& check = {});

}  // namespace afterglow::replay
