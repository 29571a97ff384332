/// \file
/// The permission of a base to drive on, and its speed, by what a range finder sees on its way.
///
/// What stands in the floor that the footprint sweeps, with a clearance all around, is come near to
/// so slowly that the base can always stop before it: at v it needs v t + v^2 / 2a. It sweeps its
/// path, and beyond its end and beside it what it would sweep until it stood. There it waits,
/// goes on when the way has been free for a while, and gives up after its patience. What is seen by
/// few beams counts if it is seen twice at the same place, or is so far away that a thin leg has
/// no more of them. What was not there half a second ago, where the scan saw that nothing was,
/// moves: a person, who gets more room. Where no beam looks it drives slowly, since nobody is seen
/// there.
///
///   ObstacleStop stop(options, "map");
///   every 20 ms: stop.move(odometry), stop.hear(scan), stop.judge(moment, path, sent)
#pragma once

#include <cstddef>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "replay/motion/base/floor.hpp"
#include "replay/motion/silence_monitor.hpp"

namespace afterglow::replay {

struct ObstacleOptions {
  Footprint footprint = Footprint::circle(0.4);
  double clearance = 0.15;      ///< m all around that is kept free
  double walker = 0.5;          ///< m more before what moves
  double deceleration = 0.5;    ///< m/s^2, of the base; the lowest of known robots is 0.7
  double reaction = 0.2;        ///< s from a scan to the base's obeying
  double unseen_speed = 0.2;    ///< m/s where the scan does not look
  double patience = 15;         ///< s of waiting in a row: given up
};

/// The report of a wait.
struct ObstacleWait {
  double seconds = 0;
  double distance = 0;  ///< m from the footprint at first; infinite: it waited for a scan
  FloorPoint place;     ///< place of the obstacle, in the track's frame
  Stamp at;             ///< moment on the track
};

struct ObstacleReport {
  std::vector<ObstacleWait> waits;  ///< the first kMost
  double waited = 0;                ///< s, all of them
  double unseen = 0;                ///< m driven where the scan does not look
  static constexpr std::size_t kMost = 100;
};

/// Decides in one thread, with all stamps by one clock.
class ObstacleStop {
 public:
  /// m/s, the highest that a verdict allows: the path is looked at so far as a stop from it takes.
  static constexpr double kFastest = 1;

  /// `frame`: the track's, for people.
  ObstacleStop(const ObstacleOptions& options, std::string frame)
      : options_(options), frame_(std::move(frame)) {}

  /// Odometry, whenever there is news of it; by it scans are where they were taken.
  void move(Stamp stamp, const PlanarPose& T_odom_base);
  /// The newest scan; the same one may be given again, and none before the first.
  void hear(const std::shared_ptr<const FloorScan>& scan);

  struct Verdict {
    enum class Kind { Go, Wait, GiveUp } kind = Kind::Go;
    double speed = kFastest;  ///< m/s of the footprint's farthest point, at most
    double distance = std::numeric_limits<double>::infinity();  ///< m to what limits the speed
    double waited = 0;                                          ///< s, in a row
    std::string reason;      ///< the reason why it does not go: a clause
    bool is_unseen = false;  ///< true: it may go where the scan does not look
  };
  struct Moment {
    Stamp now;
    PlanarPose T_odom_base, T_track_base;  ///< pose of the base when it obeys
    Stamp at;                              ///< moment on the track
    double seconds = 0;                    ///< since the last time
  };
  /// `path` begins where the base will be. `sent`: the way on which it would stand if what was sent
  /// last were its last command; it may lead beyond the path.
  Verdict judge(const Moment& moment, const SweptPath& path, const SweptPath& sent = {});
  /// Forgets what it waited for: it was stopped or paused by others.
  void rest();

  /// Returns how far ahead a path has to be known: m.
  double lookAhead() const { return wayToStop(kFastest); }
  /// Until a base of this speed stands: m.
  double wayToStop(double speed) const;
  const ObstacleOptions& options() const { return options_; }
  ObstacleReport report() const;
  /// The direction is seen by the newest scan.
  bool sees(const FloorPoint& point) const { return scan_ && scan_->sees(point); }

 private:
  std::string whyNotSeeing(Stamp now) const;
  struct Found {
    FreeWay free;
    bool is_moving = false;  ///< true: the obstacle at its end moves
  };
  Found look(const PlanarPose& T_odom_base, const SweptPath& path) const;
  Verdict goOrWait(const Moment& moment, const SweptPath& path, const SweptPath& sent);
  double speedFor(double way) const;
  void keep(const Verdict& verdict, const Moment& moment);
  PlanarPose poseAt(Stamp stamp) const;
  void take(const FloorScan& scan);
  bool moves(const FloorPoint& p_odom) const;

  const ObstacleOptions options_;
  const std::string frame_;
  std::shared_ptr<const FloorScan> scan_;
  SilenceMonitor watch_{kMotionSilence};               ///< silence of the scans
  std::deque<std::pair<Stamp, PlanarPose>> odometry_;  ///< odometry of the last moments
  struct Taken {
    std::shared_ptr<const FloorScan> scan;
    PlanarPose T_odom_base;
  };
  std::deque<Taken> recent_;           ///< the first is half a second old, or the first at all
  std::vector<FloorPoint> last_;       ///< all points of the newest scan, in odom
  std::vector<FloorPoint> obstacles_, walkers_;  ///< the points that count; those that move
  bool is_waiting_ = false;
  double free_for_ = 0;  ///< s
  ObstacleWait wait_;    ///< the wait under way, or the last one
  std::string reason_;   ///< reason of the wait
  std::optional<PlanarPose> last_pose_;  ///< pose in odom
  ObstacleReport report_;
};

}  // namespace afterglow::replay
