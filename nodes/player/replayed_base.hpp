/// \file
/// The drive of the base in a replay: the recorded pose track in closed loop. Where poses were not
/// recorded or are not told now, the base is refused; its recorded velocities are sent if that is
/// asked for.
///
/// Looks where recorded velocities would lead a base that is driven in open loop. It cannot wait,
/// for the others go on by the clock: what stands in its way ends the replay.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nodes/player/base_sensors.hpp"
#include "nodes/player/guarded_sink.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/motion/base/base_drive.hpp"
#include "replay/motion/base/base_tracker.hpp"
#include "replay/motion/base/obstacle_stop.hpp"
#include "replay/motion/motion_limits.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/play/outbox.hpp"
#include "replay/play/play_report.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Options for seeing people and things in the base's way.
struct ScanOptions {
  std::string topic;       ///< sensor_msgs/LaserScan [~scan]
  bool is_waived = false;  ///< the base drives though nothing sees them [~no_scan]
  std::optional<replay::Footprint> footprint;  ///< [~footprint]; empty: it is not known
  replay::ObstacleOptions obstacles;  ///< [~clearance, ~obstacle_wait]; its footprint is not used
};

/// ROS parameters of the same meaning are named in brackets.
struct BaseOptions {
  bool is_open_loop = false;  ///< recorded velocities, as they were [~open_loop]
  /// True: without localization, then or now, it follows its odometry from where it is
  /// [~odometry_only].
  bool is_odometry_enough = false;
  /// A drive that takes longer than the rate says is refused [~keep_rate].
  bool keeps_rate = false;
  double rate = 1;                 ///< rate at the begin
  std::string topic;               ///< the base's topic of several velocity topics [~base_topic]
  std::string usual_topic;         ///< the base's topic if that is not said: the profile's
  bool is_holonomic = false;       ///< true: it goes sideways, too: the profile's
  bool has_recorded_time = false;  ///< the clock is the recording's
  replay::TrackFrames frames;      ///< frames as recorded [~base_frame/map, .../odom, .../base]
  std::string tf_topic = "/tf";    ///< topic of today's transforms
  replay::LocalizationNoise noise;  ///< [~localization_noise/position, .../yaw]
  ScanOptions scan;
  replay::RobotNames robot;  ///< today's
};

/// The frames of today's robot, which may be another one's: as the plan renames them.
replay::TrackFrames liveFrames(const BaseOptions& options, const replay::PlayPlan& plan);

/// The base's drive, as far as a plan's recording tells.
struct RecordedDrive {
  /// Throws as ReplayedBase.
  RecordedDrive(const replay::Store& store, const replay::PlayPlan& plan,
                const BaseOptions& options);

  const replay::PlannedTopic* topic = nullptr;  ///< the base's topic; nullptr: unknown
  std::string played_topics;
  replay::Bytes sample;  ///< first message of the topic
  /// Moments of its first and last motion, other than zero.
  std::optional<replay::Stamp> first_motion, last_motion;
  std::optional<replay::PoseTrack> track;
  bool is_for_start = false;  ///< the base is only taken to the start
  std::string why_open_loop;  ///< empty: it follows its track
  std::string why_not;        ///< the reason why it cannot, as far as the recording says

 private:
  void readVelocities(const replay::Store& store, const replay::PlayPlan& plan);
};

/// The base of one replay that plays velocities, or takes the base to the start alone
/// (PlannedTopic::is_for_start). Everything given must outlive it; one thread.
class ReplayedBase {
 public:
  /// m; nobody expects a replay to drive farther on its own.
  static constexpr int kFarthestStart = 1;
  /// s of localization, whose mean is where it stands.
  static constexpr double kMeanOf = 2.0;

  /// Throws std::runtime_error, one line, for a topic that is no velocity topic of the plan, and
  /// StoreError.
  ReplayedBase(const replay::Store& store, const replay::PlayPlan& plan, const BaseOptions& options,
               const replay::MotionLimits& limits);

  /// Returns what refusal() and checkScan() say by the recording and the options alone: needs no
  /// master.
  std::string recordedRefusal() const;
  std::string scanRefusal() const;
  /// The drives that the base's limits make longer than the rate says, a clause each.
  std::vector<std::string> slowedDrives() const;

  /// Finds out whether something sees what stands in the base's way. Returns why the base must not
  /// be driven; empty if it may. `on_wait`: told what the base waits for, and with an empty text
  /// that it goes on.
  std::string checkScan(const std::function<bool()>& is_stopped,
                        std::function<void(const std::string&)> on_wait);
  /// Returns how it looks, after checkScan(); empty: without a scan.
  std::optional<replay::ObstacleOptions> obstacles() const;
  /// The newest poses and scan.
  replay::BaseInput look();

  /// The replay drives it, too.
  bool isPlayed() const { return !recorded_.is_for_start; }
  /// liveFrames()
  const replay::TrackFrames& frames() const { return live_frames_; }
  /// Returns why the base must not be driven, a clause with the way to allow it; empty: it may.
  /// Waits for today's poses, at most 3 s. Nothing is refused where only zeros would be sent.
  std::string refusal(const std::function<bool()>& is_stopped);
  /// Returns true, after refusal(), if nobody localizes it, and it follows its odometry from where
  /// it is: that cannot be compared with where it stood.
  bool isOnOdometryAlone() const { return is_on_odometry_alone_; }
  /// Returns the base's place by the mean of what localization says for a while; empty if nothing
  /// says.
  std::optional<replay::PlanarPose> measure(double seconds,
                                            const std::function<bool()>& is_stopped);
  /// Returns what localization cannot know of where the base stands and stood
  /// (StartPose::base_share), two standard deviations together, as it erred in the recording; after
  /// measure().
  replay::PoseError startDoubt(const replay::PoseError& share_then) const;
  /// Drives the standing base slowly to a pose on the map that is less than a meter away. Returns
  /// why it did not get there; empty: it did, or was stopped.
  std::string driveTo(const replay::PlanarPose& pose, GuardedSink& sink,
                      const std::function<bool()>& is_stopped);

  /// Prepares the drive, after refusal() has allowed it. Before that and in open loop drive() is
  /// none.
  void prepare(const std::function<bool()>& is_stopped);
  replay::BaseDrive* drive() { return drive_.get(); }
  /// Adds what is to be known of it, and in open loop why; the player tells of the drives.
  void addTo(replay::PlayReport& report) const;

 private:
  std::string missingNow(const std::function<bool()>& is_stopped);
  replay::TrackerOptions trackerOptions() const;
  void tellWait(const std::string& reason);

  const replay::PlayPlan& plan_;
  const BaseOptions options_;
  const replay::MotionLimits limits_;
  const replay::TrackFrames live_frames_;
  const RecordedDrive recorded_;
  std::optional<BasePoses> poses_;        ///< poses from refusal() on
  replay::PoseError share_now_ = {1, 1};  ///< share of measure(), as StartPose::base_share
  std::unique_ptr<replay::BaseDrive> drive_;
  bool is_on_odometry_alone_ = false;
  std::unique_ptr<LiveScan> scan_;  ///< scan; empty: nothing looks
  std::function<void(const std::string&)> on_wait_;
  std::string told_wait_;
  std::vector<std::string> notes_;
};

/// Stands between a player and the sink it publishes on. Everything given must outlive it; one
/// thread.
class OpenLoopMonitor : public replay::MessageSink {
 public:
  /// `look`: the newest odometry, if it is known, and scan. `stop`: ends the replay.
  OpenLoopMonitor(const replay::PlayPlan& plan, replay::MessageSink& sink,
                  const replay::ObstacleOptions& options, std::function<replay::BaseInput()> look,
                  std::function<void(const std::string& reason)> stop);

  /// A velocity whose way is not free becomes a zero and ends the replay.
  bool publish(const replay::Channel& channel, const replay::Bytes& bytes) override;

 private:
  std::string whyNot(const replay::Bytes& velocity);

  replay::MessageSink& sink_;
  replay::ObstacleStop obstacles_;
  const std::function<replay::BaseInput()> look_;
  const std::function<void(const std::string&)> stop_;
  std::set<std::string> topics_;  ///< topics of velocities
};

}  // namespace afterglow::nodes
