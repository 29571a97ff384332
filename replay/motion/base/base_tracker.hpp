/// \file
/// Drives a base along a recorded pose track, in time with it, and to its end pose.
///
/// The law is the nonlinear one for trajectory tracking with a unicycle that De Luca, Oriolo and
/// Vendittelli give in "Control of wheeled mobile robots: an experimental overview", 2001 (after
/// Samson, 1993): with the reference's velocities v_d, w_d and its pose in the base's frame
/// (e1 ahead, e2 left, e3 turn),
///   v = v_d cos e3 + k1 e1,   w = w_d + b v_d (sin e3 / e3) e2 + k3 e3,
///   k1 = k3 = 2 zeta sqrt(w_d^2 + b v_d^2).
/// It holds for driving forward, backward and for turning in place. A holonomic base has a law of
/// its own, in x, y and yaw independently: the reference's velocity, as seen from the base, and a
/// gain times each error. The reference is the track at the path time, which runs with the clock,
/// slower where the base's limits ask for it (DriveTiming), and slower, down to standing still,
/// when the base lags behind or is off: corners are not cut. A base that catches up is no more than
/// 5 % and 0.1 m/s faster than the reference, nor 5 % faster than the fastest of the drive. The end
/// is FinalApproach's, on the mean of what localization says while the base stands.
///
///   BaseTracker base(*readPoseTrack(store, behavior, frames, options.noise, why), options);
///   every 20 ms: publish(base.update({now, T_odom_base, T_map_odom}));
/// until base.state() is Done or Lost. Messages recorded during the drive wait for base.progress().
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "replay/motion/base/base_localizer.hpp"
#include "replay/motion/base/drive_timing.hpp"
#include "replay/motion/base/final_approach.hpp"
#include "replay/motion/base/obstacle_stop.hpp"
#include "replay/motion/pose_track.hpp"
#include "replay/motion/silence_monitor.hpp"

namespace afterglow::replay {

struct TrackerOptions : DriveLimits {
  double rate = 1;  ///< path time to real time; velocities scale with it, within the limits
  double command_delay = 0.08;          ///< s until the base does as it is told
  double lost_distance = 0.5;           ///< m off the track: given up
  double lost_turn = 0.52;              ///< rad
  double patience = 10;                 ///< s without getting on: given up
  double damping = 0.8, stiffness = 8;  ///< zeta, and b in 1/m^2
  bool is_holonomic = false;            ///< true: the base goes sideways, too, by linear.y
  bool with_localization = true;        ///< false: on odometry alone, the base being at the start
  LocalizationNoise noise;
  ApproachOptions approach;
  /// Options by which the base stops before what a scan sees in its way, which needs scans; without
  /// them it does not look.
  std::optional<ObstacleOptions> obstacles;
};

/// The newest poses; the same ones may be given again. All stamps by one clock.
struct BaseInput {
  Stamp now;
  std::optional<StampedPose> T_odom_base;
  std::optional<StampedPose> T_map_odom;  ///< not needed on odometry alone
  std::shared_ptr<const FloorScan> scan = nullptr;  ///< not needed without ObstacleOptions
};

enum class BaseState { Following, Approaching, Done, Lost };

/// Distances in m, turns in rad, as localization sees them (on odometry alone, as that does).
struct BaseReport {
  double end_distance = 0, end_turn = 0;  ///< distance from the recorded end pose
  /// Doubt about the end's distance and turn, two standard deviations, as localization errs now and
  /// did then; 0: not known.
  PoseError end_doubt;
  double gone_since_localized = 0;  ///< m at the end, since localization was last renewed
  double largest_distance = 0, largest_turn = 0;  ///< off the track on the way
  double drift_distance = 0, drift_turn = 0;      ///< drift of the odometry, from its first step on
  double delay = 0;                               ///< s that it took longer than recorded
  double approach = 0;                            ///< s of the final approach
  double waited = 0;                              ///< s of waiting for poses
  int corrections = 0;                            ///< moves of the final approach
  /// m beside its recorded end, left so as mending it takes a turn that was not recorded there.
  double left_aside = 0;
  ObstacleReport obstacles;
};

/// The place of a base by its odometry, and by localization unless the track or the options do
/// without.
class BasePlace {
 public:
  BasePlace(const PoseTrack& track, const TrackerOptions& options,
            std::optional<BaseLocalizer> known);

  /// Returns what is missing of the newest poses: a clause; empty if they are all there.
  std::string whyUnknown(const BaseInput& input);
  /// Takes the newest poses, which are all there.
  void take(const BaseInput& input);
  /// The odometry's drift counts from the first call on.
  void beginDrift();

  bool isLocalized() const { return is_localized_; }
  const PlanarPose& odometry() const { return odometry_; }
  /// Empty before the first poses.
  const std::optional<BaseLocalizer>& localizer() const { return localizer_; }
  /// Adds how well the place at the track's end is known, once it is.
  void addTo(BaseReport& report, const PoseTrack& track) const;

 private:
  const PlanarPose T_track_start_;
  const LocalizationNoise noise_;
  const bool is_localized_;
  std::optional<BaseLocalizer> localizer_;
  SilenceMonitor odometry_watch_{kMotionSilence}, localization_watch_{kLocalizationSilence};
  PlanarPose odometry_;
  std::optional<PlanarPose> T_map_odom_at_start_;
};

class BaseTracker {
 public:
  /// `known`: where another tracker has found the base, since when it may have moved. Throws
  /// std::invalid_argument for a rate or a limit that is not above zero.
  BaseTracker(PoseTrack track, const TrackerOptions& options,
              std::optional<BaseLocalizer> known = {});

  /// The velocity to send at once; to be called at 20 to 50 Hz. A caller that pauses sends a zero
  /// velocity, calls rest() and stops calling this.
  PlanarVelocity update(const BaseInput& input);
  /// A zero was sent, not by update().
  void rest();
  /// Changes the rate from the next update on.
  void setRate(double rate);
  /// The path time does not pass this stamp; at first there is no limit.
  void setLimit(Stamp limit) { path_.setLimit(limit); }
  /// Takes the place of the replay's timeline: a path time behind it runs a little faster. At first
  /// it is not known.
  void meet(Stamp recorded) { path_.meet(recorded); }

  BaseState state() const { return state_; }
  /// The recorded stamp that has been reached; never goes back.
  Stamp progress() const { return path_.now(); }
  /// The reason why the base is lost, or what is missing while it waits; empty otherwise.
  const std::string& reason() const { return reason_; }
  /// m off the track at the last update that followed it.
  double deviation() const { return deviation_; }
  /// The path time keeps up with the rate.
  bool isOnTime() const;
  BaseReport report() const;
  const std::optional<BaseLocalizer>& localizer() const { return place_.localizer(); }
  const PoseTrack& track() const { return track_; }

 private:
  PlanarVelocity follow(const PlanarPose& base, double seconds);
  PlanarVelocity approach(const PlanarPose& base, double seconds);
  PlanarVelocity withinReach(PlanarVelocity wanted, const PlanarPose& error,
                             Stamp reference) const;
  PlanarVelocity law(const PlanarPose& error, const PlanarVelocity& wanted) const;
  bool mayGoOn(const PlanarPose& base, const SweptPath& path, Stamp now, double seconds);
  bool mayGo(const PlanarPose& way) const;
  bool hasStrayed(const PlanarPose& error, const PlanarVelocity& recorded);
  bool isOff(const PlanarPose& error);
  void idle(double seconds, const std::string& why);
  PlanarVelocity send(const PlanarVelocity& wanted, Stamp now, double seconds);
  PlanarVelocity halt(Stamp now);

  PoseTrack track_;
  TrackerOptions options_;
  BaseState state_ = BaseState::Following;
  std::string reason_;
  BasePlace place_;
  FinalApproach approach_;
  std::optional<Stamp> last_update_;
  PathTime path_;
  DriveTiming timing_;
  PlanarVelocity led_;  ///< the reference's velocity at the last update
  PlanarVelocity way_;  ///< the last recorded velocity that was none of a rest
  BaseCommand command_;
  double idle_ = 0;       ///< s without getting on
  double taken_ = 0;      ///< s
  double deviation_ = 0;  ///< m
  std::optional<ObstacleStop> obstacles_;
  double fastest_ = std::numeric_limits<double>::infinity();  ///< m/s of its rim, by obstacles
  bool is_barred_ = false;                                    ///< true while it waits for obstacles
  BaseReport report_;
};

}  // namespace afterglow::replay
