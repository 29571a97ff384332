#include "nodes/fetch/diff_drive.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::nodes {
namespace {

using namespace std::chrono_literals;

constexpr double kMaxLinear = 1.0, kMaxAngular = 4.5;                           // m/s, rad/s
constexpr double kMaxLinearAcceleration = 0.75, kMaxAngularAcceleration = 3.0;  // per s
constexpr Nanoseconds kTimeout = 250ms;
constexpr double kTrack = 0.37476, kWheelRadius = 0.0613;

/// Along an arc of `distance` that turns by `turn`.
Pose2 advance(const Pose2& pose, double distance, double turn) {
  // The chord of an arc: exact, and well behaved for a straight line.
  const double half = turn / 2;
  const double chord = std::abs(half) < 1e-9 ? distance : distance * std::sin(half) / half;
  return {pose.x + chord * std::cos(pose.yaw + half), pose.y + chord * std::sin(pose.yaw + half),
          std::remainder(pose.yaw + turn, 2 * 3.14159265358979323846)};
}

double approach(double from, double to, double most) {
  return from + std::clamp(to - from, -most, most);
}

}  // namespace

double bell(std::mt19937& random) {
  double sum = 0;
  for (int i = 0; i < 12; ++i) sum += random() / 4294967296.0;
  return sum - 6;
}

Eigen::Isometry3d toIsometry(const Pose2& pose) {
  return Eigen::Translation3d(pose.x, pose.y, 0) *
         Eigen::AngleAxisd(pose.yaw, Eigen::Vector3d::UnitZ());
}

Pose2 compose(const Pose2& a, const Pose2& b) {
  const double c = std::cos(a.yaw), s = std::sin(a.yaw);
  return {a.x + c * b.x - s * b.y, a.y + s * b.x + c * b.y, a.yaw + b.yaw};
}

Pose2 inverse(const Pose2& pose) {
  const double c = std::cos(pose.yaw), s = std::sin(pose.yaw);
  return {-c * pose.x - s * pose.y, s * pose.x - c * pose.y, -pose.yaw};
}

DiffDrive::DiffDrive(const Pose2& start, const DriveErrors& errors)
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
  odometry_ = advance(odometry_, distance, turn);
  const double left = distance - turn * kTrack / 2, right = distance + turn * kTrack / 2;
  left_wheel_ += left / kWheelRadius;
  right_wheel_ += right / kWheelRadius;
  const double true_left = left * slipFactor(), true_right = right * slipFactor();
  true_pose_ = advance(true_pose_, errors_.linear_scale * (true_left + true_right) / 2,
                       errors_.angular_scale * (true_right - true_left) / kTrack);
}

void DiffDrive::halt() {
  commands_.clear();
  wanted_linear_ = wanted_angular_ = linear_ = angular_ = 0;
}

void DiffDrive::place(const Pose2& true_pose) {
  odometry_ = compose(inverse(mapToOdom()), true_pose);
  true_pose_ = true_pose;
  halt();
}

Pose2 DiffDrive::mapToOdom() const { return compose(true_pose_, inverse(odometry_)); }

double DiffDrive::slipFactor() { return 1 + errors_.slip * bell(random_); }

}  // namespace afterglow::nodes
