/// \file
/// The last centimeters of a replayed drive: stand, look where the base is, and if that is not
/// where it was, turn there, drive there, turn back. Short straight moves, because odometry makes
/// them well; few of them, because people watch. It turns only to where the recorded base pointed
/// at that place, and by a small angle beyond: a stretched arm sweeps what nobody has seen free.
/// An error that would need more is left. A holonomic base goes straight there and turns meanwhile.
#pragma once

#include <limits>
#include <optional>

#include "replay/motion/planar_pose.hpp"

namespace afterglow::replay {

struct ApproachOptions {
  double tolerance = 0.006;           ///< m; nearer than this is left alone
  double beside = 0.003;              ///< m that a straight move may end beside the goal
  double turn_tolerance = 0.004;      ///< rad
  double wanted_error = 0.006;        ///< m; it stands until it knows its place this well
  double wanted_turn_error = 0.0042;  ///< rad; and its yaw, or
  double shortest_stand = 0.5;        ///< s, from the last command to the first look
  double longest_stand = 6;           ///< s, or
  double longest_unchanged = 1.5;     ///< s without learning anything about its place
  int most_attempts = 3;              ///< moves before the rest is left
  double longest_move = 15;           ///< s; a move that takes longer is given up
  double speed = 0.1;                 ///< m/s
  double turn_speed = 0.3;            ///< rad/s: a hand 0.8 m away moves by 0.25 m/s
  double unrecorded_turn = 0.17;      ///< rad that it turns beyond the headings it is given
  double acceleration = 0.3;          ///< m/s^2, of braking
  double turn_acceleration = 1.0;     ///< rad/s^2
};

/// Returns those for the way to a start, which a drive may begin 2 cm before or behind, 3.5 cm
/// beside and 1 degree turned: what a correction is worth is small beside the quarter turns that it
/// takes. The check of the start (StartTolerances) bears 5 cm.
ApproachOptions approachOfStart();

class FinalApproach {
 public:
  static constexpr HeadingRange kAnywhere{-std::numeric_limits<double>::infinity(),
                                          std::numeric_limits<double>::infinity()};

  /// `headings`: where it may point at the goal, as seen from the goal's own heading.
  FinalApproach(const PlanarPose& goal, const ApproachOptions& options,
                const HeadingRange& headings = kAnywhere, bool is_holonomic = false)
      : goal_(goal), options_(options), headings_(headings), is_holonomic_(is_holonomic) {}

  /// The velocity for the next `seconds`; empty when it is over. `base`: where the base will be
  /// when that takes effect; how well that is known, m and rad.
  std::optional<PlanarVelocity> step(const PlanarPose& base, double position_error,
                                     double turn_error, double seconds);
  int attempts() const { return attempts_; }
  /// Returns true if it is over, and the rest needs a turn that it may not do.
  bool isLeftAside() const { return is_left_aside_; }
  /// Meters that it goes at most where nobody looks.
  static constexpr double kUnseenWay = 0.1;
  /// Tells it to avoid driving where nobody looks: behind it, or where a holonomic base has to go.
  /// A base with wheels turns round then, where it may.
  void avoidUnseen(bool avoids) { avoids_unseen_ = avoids; }

 private:
  enum class Phase { Stand, Turn, Drive, TurnBack, Slide };

  void enter(Phase phase);
  bool isWorthWaiting(double position_error, double turn_error) const;
  bool look(const PlanarPose& base);
  bool isWorthDrivingBeside(const PlanarPose& base, bool may_back_up) const;
  std::optional<double> turnToDrive(const PlanarPose& base, bool may_back_up) const;
  PlanarVelocity turnTo(const PlanarPose& base, double yaw, Phase next);
  PlanarVelocity drive(const PlanarPose& base);
  PlanarVelocity slide(const PlanarPose& base);

  PlanarPose goal_;
  ApproachOptions options_;
  HeadingRange headings_;
  bool is_holonomic_;
  Phase phase_ = Phase::Stand;
  double in_phase_ = 0;   ///< s
  double known_ = 0;      ///< the position error last heard of, m
  double unchanged_ = 0;  ///< s since it was another
  double heading_ = 0;    ///< direction to drive along, forward or backward
  int attempts_ = 0;
  bool avoids_unseen_ = false, is_left_aside_ = false;
};

}  // namespace afterglow::replay
