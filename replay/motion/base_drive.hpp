/// \file
/// The base of a replay, in closed loop: instead of sending recorded velocities, it drives along
/// the recorded pose track, stand by stand, and what goes with it waits for it.
///
/// The player's scheduler calls step() every 20 ms while isBusy(), sends what it says to topic(),
/// and lets its timeline not pass the limit. Recorded velocities of topic() are not sent.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/motion/base_tracker.hpp"
#include "replay/motion/pose_track.hpp"

namespace afterglow::replay {

/// From one stand to the next.
struct DriveReport {
  Stamp begin, end;  ///< recorded
  BaseState state = BaseState::Following;
  BaseReport base;
};

struct BaseDriveReport {
  std::string topic;
  std::string frame;          ///< of the track
  bool is_localized = false;  ///< false: followed on odometry alone
  double length = 0;          ///< m of the track, forward and backward
  /// Those that were driven, in their order; after a seek one may come again.
  std::vector<DriveReport> drives;
  double delay = 0;   ///< s that all of them took longer than recorded, final approaches included
  std::string lost;   ///< why it was given up; empty if it was not
  double waited = 0;  ///< s of waiting for poses
};

/// One thread. A drive lies between two stands of at least a second; each is driven by a
/// BaseTracker of its own, with the final approach at its end: a cursory one before a stand of less
/// than 3 s, where nothing is done that needs the place exactly.
class BaseDrive {
 public:
  /// The newest poses of the base, as BaseInput has them; `now` is ROS time.
  using Look = std::function<BaseInput(Stamp now)>;

  /// `sample`: a message of the velocity topic, whose header, if any, every command gets. Only what
  /// the base did in [begin, end) is driven. Options' rate is not looked at. Throws
  /// std::invalid_argument for limits that are none, and a sample that has no velocity.
  BaseDrive(std::string topic, Bytes sample, const PoseTrack& track, Stamp begin, Stamp end,
            const TrackerOptions& options, Look look);

  /// False: the base stood all the time, and nothing is to be replaced.
  bool hasDrives() const { return !drives_.empty(); }
  /// As it was recorded.
  const std::string& topic() const { return topic_; }

  /// The replay begins there, or goes on there after a seek. In the middle of a drive the base is
  /// brought along from where it is, if that is near enough; between two it is first brought to
  /// where it stood, except at the first call, when the start has been checked. If it is too far
  /// away, the first step says so (failure()).
  void enter(Stamp at);

  /// Whether step() is to be called at this recorded moment: until the drive's end has been
  /// reached in space, whatever the moment.
  bool isBusy(Stamp at) const;
  /// When that is so next: the begin of the drive that comes or is under way; the far future after
  /// the last one.
  Stamp nextBegin() const;
  /// What the timeline may not pass now: the base's progress and a little, or nextBegin().
  Stamp limit() const { return limit_; }

  struct Step {
    std::optional<PlanarVelocity> command;  ///< to be sent; none: nothing
    Stamp limit;                            ///< the new limit()
  };
  /// `at`: where the timeline is; is_held: something else holds it there, so that the base, when it
  /// has got there, stands. `rate`: recorded seconds a second of `ros_now`.
  Step step(Stamp at, bool is_held, double rate, Stamp ros_now);
  /// The caller has sent a zero and does not call step() for a while: a pause, a stop.
  void rest();

  /// The command as a message for topic(), stamped with `now` if it has a header.
  Bytes message(const PlanarVelocity& command, Stamp now) const;

  /// Why it was given up; empty while it is not. It stands then, and is not busy any more; only
  /// enter() begins anew.
  const std::string& failure() const { return failure_; }
  /// What it waits for at the moment: "no odometry for 0.4 s"; empty if for nothing.
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
  void start(Stamp from, Stamp to, bool is_passing);
  Step follow(Stamp at, bool is_held, double rate, Stamp ros_now);
  void finish();
  DriveReport current() const;

  const std::string topic_;
  const Bytes sample_;
  const PoseTrack track_;
  const TrackerOptions options_;
  const Look look_;
  std::vector<Drive> drives_;
  std::size_t next_ = 0;                  ///< drive, under way or to come
  std::unique_ptr<BaseTracker> tracker_;  ///< of what is under way
  bool is_return_ = false;              ///< what is under way only brings the base to where it was
  bool has_entered_ = false;            ///< once
  std::optional<BaseLocalizer> known_;  ///< where the last tracker found the base
  Stamp begin_;                         ///< where it was entered
  Stamp limit_;
  std::string failure_;
  BaseDriveReport report_;
};

}  // namespace afterglow::replay
