/// \file
/// The base of a replay, in closed loop: instead of repeating recorded velocities, it drives along
/// the recorded pose track, from one stand to the next; light and speech wait for the base.
///
/// The player calls step() every 20 ms while isBusy(), publishes the command on topic(), and keeps
/// its timeline from passing the limit. Recorded velocities of topic() are not sent.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/motion/base/base_tracker.hpp"
#include "replay/motion/pose_track.hpp"

namespace afterglow::replay {

/// The report of a drive from one stand to the next.
struct DriveReport {
  Stamp begin, end;  ///< recorded
  BaseState state = BaseState::Following;
  BaseReport base;
};

struct BaseDriveReport {
  std::string topic;
  std::string frame;          ///< frame of the track
  bool is_localized = false;  ///< false: followed on odometry alone
  double length = 0;          ///< m of the track, forward and backward
  /// The drives in the order they were driven; after a seek one may come again.
  std::vector<DriveReport> drives;
  double delay = 0;   ///< s that all of them took longer than recorded, final approaches included
  std::string lost;   ///< the reason why it was given up; empty if it was not
  double waited = 0;  ///< s of waiting for poses
  ObstacleReport obstacles;  ///< obstacles of all drives
};

/// Drives a base along its track; one thread. A drive lies between two stands of at least a second;
/// each is driven by a BaseTracker of its own and ends with a final approach, a less exact one
/// before a stand of less than 3 s: such a stand is too short for work that needs the exact place.
class BaseDrive {
 public:
  /// The newest poses of the base, as BaseInput has them; `now` is ROS time.
  using Look = std::function<BaseInput(Stamp now)>;

  /// `sample`: a message of the velocity topic, whose header, if any, every command gets. Only the
  /// drives in [begin, end) are driven. The options' rate is ignored. Throws std::invalid_argument
  /// for limits that are not above zero, and for a sample that has no velocity.
  BaseDrive(std::string topic, Bytes sample, const PoseTrack& track, Stamp begin, Stamp end,
            const TrackerOptions& options, Look look);

  /// False: the base stood all the time, and its recorded velocities are played as they are.
  bool hasDrives() const { return !drives_.empty(); }
  /// A drive and how long it will take within the base's limits.
  struct Timing {
    Stamp begin, end;  ///< recorded
    double seconds = 0;
  };
  std::vector<Timing> timings(double rate) const;
  /// The topic as it was recorded.
  const std::string& topic() const { return topic_; }

  /// The replay begins at this recorded moment, or goes on there after a seek. In the middle of a
  /// drive the base joins the track from where it is, if that is near enough; between two drives it
  /// first goes to where it stood then, except at the first call, when the start has been checked.
  /// If it is too far away, the first step fails (failure()).
  void enter(Stamp at);

  /// Returns true if step() has to be called at this recorded moment: during a drive, and after it
  /// until the base has reached the drive's end.
  bool isBusy(Stamp at) const;
  /// The begin of the drive that is under way or comes next; after the last one the far future.
  Stamp nextBegin() const;
  /// The recorded moment that the timeline must not pass now: a little after the base's progress,
  /// or nextBegin().
  Stamp limit() const { return limit_; }

  struct Step {
    std::optional<PlanarVelocity> command;  ///< command to be sent; without a value nothing is sent
    Stamp limit;                            ///< the new limit()
  };
  /// Takes a step at `at`, the timeline's place; is_held: a goal holds the timeline, so the base
  /// stands when it has caught up. `rate`: recorded seconds a second of `ros_now`.
  Step step(Stamp at, bool is_held, double rate, Stamp ros_now);
  /// The caller has sent a zero velocity and does not call step() for a while: a pause, a stop.
  void rest();

  /// The command as a message for topic(), stamped with `now` if it has a header.
  Bytes message(const PlanarVelocity& command, Stamp now) const;

  /// The reason why the drive was given up; empty if it was not. The base stands then and isBusy()
  /// is false until enter() is called.
  const std::string& failure() const { return failure_; }
  /// Returns why the base waits at the moment: "no odometry for 0.4 s"; empty if it does not wait.
  std::string reason() const;
  /// The recorded moment that the base has got to; empty while no drive is under way.
  std::optional<Stamp> progress() const;
  /// m off the recorded track, at the last step; empty while it is not following one.
  std::optional<double> deviation() const;
  BaseDriveReport report() const;

 private:
  struct Drive {
    Stamp begin, end;
    bool is_passing = false;  ///< the stand at its end is too short for anything to be done there
  };

  void rememberStart(Stamp at);
  void findDrives(Stamp begin, Stamp end);
  void start(Stamp from, Stamp to);
  bool isPassing() const { return !is_return_ && drives_[next_].is_passing; }
  Step follow(Stamp at, bool is_held, double rate, Stamp ros_now);
  std::string whyNotThere() const;
  void finish();
  DriveReport current() const;

  const std::string topic_;
  const Bytes sample_;
  const PoseTrack track_;
  const TrackerOptions options_;
  const Look look_;
  std::vector<Drive> drives_;
  std::size_t next_ = 0;                  ///< drive, under way or to come
  std::unique_ptr<BaseTracker> tracker_;  ///< tracker of the drive under way
  bool is_return_ = false;                ///< true: the drive only brings the base back
  bool has_entered_ = false;            ///< once
  std::optional<BaseLocalizer> known_;  ///< the base's place by the last tracker
  Stamp begin_;                         ///< moment at which it was entered
  Stamp limit_;
  std::string failure_;
  BaseDriveReport report_;
};

}  // namespace afterglow::replay
