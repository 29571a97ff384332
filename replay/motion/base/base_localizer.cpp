#include "replay/motion/base/base_localizer.hpp"

#include <algorithm>

namespace afterglow::replay {
namespace {

constexpr int kMostOutliers = 5;

double square(double value) { return value * value; }

}  // namespace

bool isJump(const PlanarPose& from, const PlanarPose& to, const LocalizationNoise& noise) {
  return distance(from, to) > noise.jump ||
         std::abs(wrapAngle(to.yaw - from.yaw)) > noise.jump_turn;
}

BaseLocalizer::BaseLocalizer(const LocalizationNoise& noise, const PlanarPose& T_map_odom,
                             const PlanarPose& odometry, Stamp at)
    : noise_(noise),
      pose_(compose(T_map_odom, odometry)),
      odometry_(odometry),
      last_correction_(T_map_odom),
      corrected_at_(at) {
  covariance_(3, 3) = covariance_(4, 4) = square(noise.scale);
  forgetPose();
}

void BaseLocalizer::forgetPose() {
  covariance_.topRows<3>().setZero();
  covariance_.leftCols<3>().setZero();
  covariance_.diagonal().head<3>() << square(noise_.position), square(noise_.position),
      square(noise_.yaw);
}

void BaseLocalizer::move(const PlanarPose& odometry) {
  PlanarPose step = between(odometry_, odometry);
  odometry_ = odometry;
  if (step.x == 0 && step.y == 0 && step.yaw == 0) return;
  const double turn = step.yaw, length = std::hypot(step.x, step.y);
  gone_ += length;
  const double c = std::cos(pose_.yaw), s = std::sin(pose_.yaw);
  // The step on the map, as the odometry measured it.
  const double dx = c * step.x - s * step.y, dy = s * step.x + c * step.y;
  step = {step.x * (1 + distance_scale_), step.y * (1 + distance_scale_),
          step.yaw * (1 + turn_scale_)};
  pose_ = compose(pose_, step);

  // P <- F P F' + Q, with F the step's derivative by the state: the identity and these.
  Covariance F = Covariance::Identity();
  F(0, 2) = -dy, F(1, 2) = dx;
  F(0, 3) = dx, F(1, 3) = dy;
  F(2, 4) = turn;
  covariance_ = F * covariance_ * F.transpose();
  const double slip = square(noise_.slip) * length;
  const double turn_slip =
      square(noise_.slip_turn) * length + square(noise_.turn_slip) * std::abs(turn);
  covariance_.diagonal().head<3>() += Eigen::Vector3d(slip, slip, turn_slip);
}

void BaseLocalizer::correct(const PlanarPose& T_map_odom, Stamp at) {
  if (T_map_odom == last_correction_) return;
  last_correction_ = T_map_odom;
  gone_ = 0;
  const double since = std::abs(static_cast<double>(at.ns - corrected_at_.ns)) * 1e-9;
  corrected_at_ = at;
  const PlanarPose measured = compose(T_map_odom, odometry_);
  if (isJump(pose_, measured, noise_)) {
    if (++outliers_ < kMostOutliers) return;
    pose_ = measured;
    forgetPose();
    outliers_ = 0;
    return;
  }
  outliers_ = 0;
  // Measurements that share their error are worth fewer independent ones: the mean of many that
  // are dt apart has the variance that one in 2 * correlation / dt of them would have.
  const double worth =
      noise_.correlation > 0 ? std::clamp(since / (2 * noise_.correlation), 1e-3, 1.) : 1;
  observe(0, measured.x - pose_.x, square(noise_.position) / worth);
  observe(1, measured.y - pose_.y, square(noise_.position) / worth);
  observe(2, wrapAngle(measured.yaw - pose_.yaw), square(noise_.yaw) / worth);
}

void BaseLocalizer::observe(Eigen::Index axis, double innovation, double variance) {
  using State = Eigen::Matrix<double, 5, 1>;
  const State column = covariance_.col(axis);
  const State gain = column / (column[axis] + variance);
  pose_.x += gain[0] * innovation;
  pose_.y += gain[1] * innovation;
  pose_.yaw = wrapAngle(pose_.yaw + gain[2] * innovation);
  distance_scale_ += gain[3] * innovation;
  turn_scale_ += gain[4] * innovation;
  covariance_ -= gain * column.transpose();
}

double BaseLocalizer::positionError() const {
  return std::sqrt(std::max({covariance_(0, 0), covariance_(1, 1), 0.}));
}

double BaseLocalizer::yawError() const { return std::sqrt(std::max(covariance_(2, 2), 0.)); }

PoseError BaseLocalizer::error(const PoseError& measured) const {
  const auto share = [](double known, double one) { return one > 0 ? known / one : 0; };
  return {measured.position * share(positionError(), noise_.position),
          measured.yaw * share(yawError(), noise_.yaw)};
}

}  // namespace afterglow::replay
