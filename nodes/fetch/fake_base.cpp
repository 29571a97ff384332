#include "nodes/fetch/fake_base.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::nodes {
namespace {

using namespace std::chrono_literals;

constexpr double kMaxLinear = 1.0, kMaxAngular = 4.5;                           // m/s, rad/s
constexpr double kMaxLinearAcceleration = 0.75, kMaxAngularAcceleration = 3.0;  // per s
constexpr Nanoseconds kTimeout = 250ms;
constexpr Nanoseconds kMeasuringPeriod = 200ms, kMeasuringDelay = 100ms;
/// The share of an error in the next one: exp(-0.2 s / 0.2 s), what follows itself within 0.2 s.
constexpr double kShared = 0.36788;
constexpr double kTrack = 0.37476, kWheelRadius = 0.0613;

double approach(double from, double to, double most) {
  return from + std::clamp(to - from, -most, most);
}

/// Returns a number of mean 0 and deviation 1: twelve uniform numbers make a good bell, and
/// std::normal_distribution differs between libraries.
double bell(std::mt19937& random) {
  double sum = 0;
  for (int i = 0; i < 12; ++i) sum += static_cast<double>(random()) / 4294967296.0;
  return sum - 6;
}

}  // namespace

DiffDrive::DiffDrive(const PlanarPose& start, const DriveErrors& errors)
    : errors_(errors), random_(errors.seed), true_pose_(start) {}

bool DiffDrive::command(double linear, double angular, Nanoseconds now) {
  if (!std::isfinite(linear) || !std::isfinite(angular)) return false;
  commands_.push_back({now + errors_.latency, std::clamp(linear, -kMaxLinear, kMaxLinear),
                       std::clamp(angular, -kMaxAngular, kMaxAngular)});
  return true;
}

void DiffDrive::obey(Nanoseconds now) {
  for (; !commands_.empty() && commands_.front().due <= now; commands_.pop_front()) {
    wanted_linear_ = commands_.front().linear;
    wanted_angular_ = commands_.front().angular;
    last_command_ = commands_.front().due;
  }
  if (now - last_command_ >= kTimeout) wanted_linear_ = wanted_angular_ = 0;
}

void DiffDrive::step(Nanoseconds now, Nanoseconds dt) {
  obey(now);
  const double seconds = std::chrono::duration<double>(dt).count();
  linear_ = approach(linear_, wanted_linear_, kMaxLinearAcceleration * seconds);
  angular_ = approach(angular_, wanted_angular_, kMaxAngularAcceleration * seconds);
  const double distance = linear_ * seconds, turn = angular_ * seconds;
  odometry_ = alongArc(odometry_, distance, turn);
  const double left = distance - turn * kTrack / 2, right = distance + turn * kTrack / 2;
  left_wheel_ += left / kWheelRadius;
  right_wheel_ += right / kWheelRadius;
  const double true_left = left * slipFactor(), true_right = right * slipFactor();
  true_pose_ = alongArc(true_pose_, errors_.linear_scale * (true_left + true_right) / 2,
                        errors_.angular_scale * (true_right - true_left) / kTrack);
}

void DiffDrive::halt() {
  commands_.clear();
  wanted_linear_ = wanted_angular_ = linear_ = angular_ = 0;
}

void DiffDrive::place(const PlanarPose& true_pose) {
  odometry_ = compose(inverse(mapToOdom()), true_pose);
  true_pose_ = true_pose;
  halt();
}

PlanarPose DiffDrive::mapToOdom() const { return compose(true_pose_, inverse(odometry_)); }

double DiffDrive::slipFactor() { return 1 + errors_.slip * bell(random_); }

FakeLocalization::FakeLocalization(const LocalizationErrors& errors, const DiffDrive& base)
    : errors_(errors),
      random_(errors.seed),
      error_{errors.position * bell(random_), errors.position * bell(random_),
             errors.yaw * bell(random_)},
      known_(measure(base)) {}

void FakeLocalization::relocate(const DiffDrive& base) {
  measured_.clear();
  known_ = measure(base);
}

bool FakeLocalization::isDue(Nanoseconds now, const DiffDrive& base) const {
  if (errors_.distance == 0 && errors_.turn == 0) return now >= next_;
  const PlanarPose moved = compose(inverse(measured_at_), base.odometry());
  return std::hypot(moved.x, moved.y) >= errors_.distance ||
         std::abs(moved.yaw) >= errors_.turn;
}

void FakeLocalization::step(Nanoseconds now, const DiffDrive& base) {
  const bool is_exact = errors_.position == 0 && errors_.yaw == 0;
  if (is_exact && errors_.distance == 0 && errors_.turn == 0) {
    known_ = base.mapToOdom();
    return;
  }
  if (isDue(now, base)) {
    next_ = now + kMeasuringPeriod;
    measured_.push_back({now + kMeasuringDelay, measure(base)});
  }
  for (; !measured_.empty() && measured_.front().known <= now; measured_.pop_front())
    known_ = measured_.front().map_to_odom;
}

PlanarPose FakeLocalization::measure(const DiffDrive& base) {
  const double fresh = std::sqrt(1 - kShared * kShared);
  const auto pass = [&](double& error, double deviation) {
    error = kShared * error + fresh * deviation * bell(random_);
  };
  pass(error_.x, errors_.position);
  pass(error_.y, errors_.position);
  pass(error_.yaw, errors_.yaw);
  measured_at_ = base.odometry();
  const PlanarPose& truth = base.truePose();
  const PlanarPose seen{truth.x + error_.x, truth.y + error_.y, truth.yaw + error_.yaw};
  return compose(seen, inverse(base.odometry()));
}

}  // namespace afterglow::nodes
