#include "replay/motion/base_localizer.hpp"

#include <algorithm>

namespace afterglow::replay {
namespace {

constexpr int kMostOutliers = 5;

double square(double value) { return value * value; }

bool isSame(const PlanarPose& a, const PlanarPose& b) {
  return a.x == b.x && a.y == b.y && a.yaw == b.yaw;
}

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
  covariance_[3][3] = covariance_[4][4] = square(noise.scale);
  forgetPose();
}

void BaseLocalizer::forgetPose() {
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < kSize; ++j) covariance_[i][j] = covariance_[j][i] = 0;
  }
  covariance_[0][0] = covariance_[1][1] = square(noise_.position);
  covariance_[2][2] = square(noise_.yaw);
}

void BaseLocalizer::move(const PlanarPose& odometry) {
  PlanarPose step = between(odometry_, odometry);
  odometry_ = odometry;
  if (step.x == 0 && step.y == 0 && step.yaw == 0) return;
  const double turn = step.yaw, length = std::hypot(step.x, step.y);
  const double c = std::cos(pose_.yaw), s = std::sin(pose_.yaw);
  // The step on the map, as the odometry measured it.
  const double dx = c * step.x - s * step.y, dy = s * step.x + c * step.y;
  step = {step.x * (1 + distance_scale_), step.y * (1 + distance_scale_),
          step.yaw * (1 + turn_scale_)};
  pose_ = compose(pose_, step);

  // P <- F P F' + Q, with F the step's derivative by the state: the identity and these.
  std::array<State, kSize> F{};
  for (std::size_t i = 0; i < kSize; ++i) F[i][i] = 1;
  F[0][2] = -dy, F[1][2] = dx;
  F[0][3] = dx, F[1][3] = dy;
  F[2][4] = turn;
  std::array<State, kSize> FP{}, FPF{};
  for (std::size_t i = 0; i < kSize; ++i) {
    for (std::size_t k = 0; k < kSize; ++k) {
      if (F[i][k] == 0) continue;
      for (std::size_t j = 0; j < kSize; ++j) FP[i][j] += F[i][k] * covariance_[k][j];
    }
  }
  for (std::size_t i = 0; i < kSize; ++i) {
    for (std::size_t j = 0; j < kSize; ++j) {
      for (std::size_t k = 0; k < kSize; ++k) FPF[i][j] += FP[i][k] * F[j][k];
    }
  }
  covariance_ = FPF;
  covariance_[0][0] += square(noise_.slip) * length;
  covariance_[1][1] += square(noise_.slip) * length;
  covariance_[2][2] +=
      square(noise_.slip_turn) * length + square(noise_.turn_slip) * std::abs(turn);
}

void BaseLocalizer::correct(const PlanarPose& T_map_odom, Stamp at) {
  if (isSame(T_map_odom, last_correction_)) return;
  last_correction_ = T_map_odom;
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

void BaseLocalizer::observe(std::size_t axis, double innovation, double variance) {
  const double total = covariance_[axis][axis] + variance;
  State gain;
  for (std::size_t i = 0; i < kSize; ++i) gain[i] = covariance_[i][axis] / total;
  pose_.x += gain[0] * innovation;
  pose_.y += gain[1] * innovation;
  pose_.yaw = wrapAngle(pose_.yaw + gain[2] * innovation);
  distance_scale_ += gain[3] * innovation;
  turn_scale_ += gain[4] * innovation;
  const State row = covariance_[axis];
  for (std::size_t i = 0; i < kSize; ++i) {
    for (std::size_t j = 0; j < kSize; ++j) covariance_[i][j] -= gain[i] * row[j];
  }
}

double BaseLocalizer::positionError() const {
  return std::sqrt(std::max({covariance_[0][0], covariance_[1][1], 0.}));
}

double BaseLocalizer::yawError() const { return std::sqrt(std::max(covariance_[2][2], 0.)); }

}  // namespace afterglow::replay
