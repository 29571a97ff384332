/// \file
/// A base that does not quite do what it is told, the localization that does not
/// quite see where it is, and a detour to drive. Everything is random by a seed, and the same
/// everywhere.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <vector>

#include "replay/motion/base/base_tracker.hpp"
#include "replay/motion/base/track_reader.hpp"

namespace afterglow::test {

constexpr double kStep = 0.01;  // s of simulation
constexpr double kDegree = replay::kPi / 180;

inline replay::Stamp stampAt(double seconds) {
  return {1'000'000'000'000 + static_cast<std::int64_t>(std::llround(seconds * 1e9))};
}

/// std::normal_distribution differs between libraries; twelve uniform numbers make a good bell.
class Bell {
 public:
  explicit Bell(std::uint32_t seed) : random_(seed) {}
  double operator()(double deviation) {
    double sum = 0;
    for (int i = 0; i < 12; ++i) sum += random_() / 4294967296.0;
    return deviation * (sum - 6);
  }
  replay::PlanarPose pose(double position, double yaw) {
    const double x = (*this)(position), y = (*this)(position);
    return {x, y, (*this)(yaw)};
  }

 private:
  std::mt19937 random_;
};

/// How a base obeys; a Fetch's.
struct DriveManners {
  double acceleration = 0.75, turn_acceleration = 3;  ///< m/s^2, rad/s^2
  double timeout = 0.25;       ///< s after its last command it stops by itself
  bool stops_at_once = false;  ///< then; else it brakes
  bool is_holonomic = false;
  double fastest = 1e9, fastest_back = 1e9, fastest_turn = 1e9;  ///< what is faster is cut
  double lag = 0;  ///< s by which its wheels follow its ramps, first order
};
/// pr2_controllers' pr2_base_controller2.
inline constexpr DriveManners kPr2Manners{2, 2, 0.2, true, true};

struct DriveFaults {
  double distance_scale = 1, turn_scale = 1;  ///< true way to what the wheels measure
  double slip = 0;       ///< of each wheel's travel in a step, relative; independent
  double delay = 0.08;   ///< s from a command to its effect
  double track = 0.375;  ///< m between the wheels
  DriveManners manners = {};
};

class SimulatedDrive {
 public:
  SimulatedDrive(const replay::PlanarPose& start, const replay::PlanarPose& odometry,
                 const DriveFaults& faults, std::uint32_t seed)
      : truth_(start), odometry_(odometry), faults_(faults), bell_(seed) {}

  void command(double now, const replay::PlanarVelocity& velocity) {
    const DriveManners& manners = faults_.manners;
    const double aside = manners.is_holonomic ? manners.fastest : 0;
    commands_.push_back(
        {now + faults_.delay,
         {std::clamp(velocity.forward, -manners.fastest_back, manners.fastest),
          std::clamp(velocity.turn, -manners.fastest_turn, manners.fastest_turn),
          std::clamp(velocity.left, -aside, aside)}});
  }
  /// Lets a step pass, from `now` on.
  void step(double now) {
    for (; !commands_.empty() && commands_.front().at <= now + 1e-9; commands_.pop_front()) {
      wanted_ = commands_.front();
    }
    const DriveManners& manners = faults_.manners;
    const bool is_silent = now - wanted_.at > manners.timeout;
    if (is_silent) wanted_.velocity = {};
    const replay::PlanarVelocity wanted = is_stuck ? replay::PlanarVelocity() : wanted_.velocity;
    const double at_once = is_silent && manners.stops_at_once ? 1e9 : 0;
    approach(wanted.forward, std::max(at_once, manners.acceleration), ramped_.forward);
    approach(wanted.left, std::max(at_once, manners.acceleration), ramped_.left);
    approach(wanted.turn, std::max(at_once, manners.turn_acceleration), ramped_.turn);
    const double share = manners.lag > 0 ? kStep / (manners.lag + kStep) : 1;
    velocity_.forward += share * (ramped_.forward - velocity_.forward);
    velocity_.left += share * (ramped_.left - velocity_.left);
    velocity_.turn += share * (ramped_.turn - velocity_.turn);
    odometry_ = advance(odometry_, velocity_, kStep);
    truth_ = advance(truth_, manners.is_holonomic ? slide() : roll(), kStep);
  }

  replay::PlanarPose truth() const { return truth_; }
  replay::PlanarPose odometry() const { return odometry_; }
  replay::PlanarVelocity velocity() const { return velocity_; }
  void push(const replay::PlanarPose& to) { truth_ = to; }
  bool is_stuck = false;

 private:
  struct Command {
    double at = -1;
    replay::PlanarVelocity velocity;
  };
  // What its wheels do in truth: with two of them, with as many as it takes to go sideways.
  replay::PlanarVelocity roll() {
    const double half = velocity_.turn * faults_.track / 2;
    const double left = (velocity_.forward - half) * (1 + bell_(faults_.slip));
    const double right = (velocity_.forward + half) * (1 + bell_(faults_.slip));
    return {faults_.distance_scale * (left + right) / 2,
            faults_.turn_scale * (right - left) / faults_.track};
  }
  replay::PlanarVelocity slide() {
    const double ahead = faults_.distance_scale * (1 + bell_(faults_.slip));
    const double aside = faults_.distance_scale * (1 + bell_(faults_.slip));
    const double around = faults_.turn_scale * (1 + bell_(faults_.slip));
    return {velocity_.forward * ahead, velocity_.turn * around, velocity_.left * aside};
  }
  static void approach(double wanted, double limit, double& value) {
    value += std::clamp(wanted - value, -limit * kStep, limit * kStep);
  }

  replay::PlanarPose truth_, odometry_;
  DriveFaults faults_;
  Bell bell_;
  std::deque<Command> commands_;
  Command wanted_;
  replay::PlanarVelocity ramped_, velocity_;
};

/// Measures every 0.1 s and is heard 0.1 s later. Each measurement's error shares
/// exp(-0.1 s / correlation) with the one before (a Gauss-Markov process); 0: none.
struct LocalizationFaults {
  double position = 0, yaw = 0;  ///< standard deviations; in x and in y
  double correlation = 0.2;      ///< s
};

/// Of AMCL's grade, and of a good one's. Successive measurements, 0.1 s apart, share 60 % of
/// their error.
inline constexpr LocalizationFaults k3Cm{0.03, kDegree, 0.2};
inline constexpr LocalizationFaults k1Cm{0.01, 0.2 * kDegree, 0.2};

class SimulatedLocalization {
 public:
  SimulatedLocalization(const LocalizationFaults& faults, std::uint32_t seed)
      : faults_(faults), bell_(seed), error_(bell_.pose(faults.position, faults.yaw)) {
    shared_ = faults.correlation > 0 ? std::exp(-0.1 / faults.correlation) : 0;
  }
  /// map -> odom as it is known at `now`; empty before the first.
  std::optional<replay::StampedPose> look(double now, const SimulatedDrive& drive) {
    if (now >= next_ - 1e-9) {
      next_ += 0.1;
      const double fresh = std::sqrt(1 - shared_ * shared_);
      const replay::PlanarPose noise = bell_.pose(faults_.position * fresh, faults_.yaw * fresh);
      error_ = {shared_ * error_.x + noise.x, shared_ * error_.y + noise.y,
                shared_ * error_.yaw + noise.yaw};
      const replay::PlanarPose truth = drive.truth();
      const replay::PlanarPose seen{truth.x + error_.x, truth.y + error_.y, truth.yaw + error_.yaw};
      pending_.push_back({now + 0.1, {stampAt(now), compose(seen, inverse(drive.odometry()))}});
    }
    for (; !pending_.empty() && pending_.front().at <= now + 1e-9; pending_.pop_front()) {
      heard_ = pending_.front().pose;
    }
    return heard_;
  }

 private:
  struct Pending {
    double at;
    replay::StampedPose pose;
  };
  LocalizationFaults faults_;
  Bell bell_;
  double shared_, next_ = 0;
  replay::PlanarPose error_;
  std::deque<Pending> pending_;
  std::optional<replay::StampedPose> heard_;
};

/// Velocities every 0.02 s, as a person or a planner commanded them when it was recorded.
using Commands = std::vector<replay::PlanarVelocity>;
constexpr double kCommandPeriod = 0.02;

inline void stand(Commands& commands, double seconds) {
  commands.insert(commands.end(), static_cast<std::size_t>(seconds / kCommandPeriod), {});
}

/// How fast to be after `gone` of `length`, at 0.5 m/s^2 or 1.5 rad/s^2.
inline double profile(double gone, double length, double fastest, double acceleration) {
  const double up =
      std::sqrt(2 * acceleration * std::max(gone, 0.)) + acceleration * kCommandPeriod;
  const double down = std::sqrt(2 * acceleration * std::max(length - gone, 0.));
  return std::min({up, down, fastest});
}

inline void turn(Commands& commands, double angle) {
  double gone = 0;
  while (std::abs(angle) - gone > 1e-3) {
    const double speed = std::min(profile(gone, std::abs(angle), 1.0, 1.5),
                                  (std::abs(angle) - gone) / kCommandPeriod);
    commands.push_back({0, std::copysign(speed, angle)});
    gone += speed * kCommandPeriod;
  }
}

/// Straight on by `length` (negative: backward), bent to the left by `offset` in the middle: sin^2.
inline void drive(Commands& commands, double length, double offset) {
  const double far = std::abs(length), k = replay::kPi / far;
  double x = 0;
  while (far - x > 1e-3) {
    const double slope = offset * k * std::sin(2 * k * x);
    const double bend = 2 * offset * k * k * std::cos(2 * k * x);
    const double speed = std::min(profile(x, far, 0.5, 0.5), (far - x) / kCommandPeriod);
    const double way = std::sqrt(1 + slope * slope);
    const double sign = std::copysign(1., length);
    commands.push_back({sign * speed, speed * bend / (way * way * way)});
    x += speed / way * kCommandPeriod;
  }
}

/// The paper's figure: a turn to the path, 3 m round something, a turn at the goal.
inline Commands detour() {
  Commands commands;
  stand(commands, 0.5);
  turn(commands, 90 * kDegree);
  drive(commands, 3, 0.5);
  turn(commands, -90 * kDegree);
  stand(commands, 0.5);
  return commands;
}

/// What is left of a drive: where it truly went, and its track as it was recorded.
struct RecordedDrive {
  replay::PlanarPose start, end;
  std::vector<replay::PlanarPose> truth;  ///< a pose a step
  replay::PoseTrack track;
  Commands commands;
};

/// `stood`: s that localization was heard after the track's end, the robot standing.
inline RecordedDrive record(const Commands& commands, const DriveFaults& faults,
                            const LocalizationFaults& localization, std::uint32_t seed,
                            const replay::LocalizationNoise& noise = {}, double stood = 0) {
  SimulatedDrive robot({2, 1, 0.3}, {}, faults, seed);
  SimulatedLocalization seen(localization, seed + 1);
  replay::TrackBuilder builder(noise);
  std::vector<replay::PlanarPose> truth;
  const auto steps = static_cast<int>(static_cast<double>(commands.size()) * 2);
  for (int i = 0; i < steps + 50; ++i) {  // half a second until it stands
    const double now = i * kStep;
    if (i % 2 == 0 && i < steps) robot.command(now, commands[static_cast<std::size_t>(i / 2)]);
    builder.addOdometry(stampAt(now), robot.odometry());
    if (const auto pose = seen.look(now, robot)) builder.addLocalization(stampAt(now), pose->pose);
    truth.push_back(robot.truth());
    robot.step(now);
  }
  for (double now = (steps + 50) * kStep, end = now + stood; now < end; now += kStep) {
    if (const auto pose = seen.look(now, robot)) builder.addLocalization(stampAt(now), pose->pose);
  }
  return {truth.front(), truth.back(), truth, builder.build("map", "odom"), commands};
}

}  // namespace afterglow::test
