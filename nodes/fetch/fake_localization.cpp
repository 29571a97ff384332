#include "nodes/fetch/fake_localization.hpp"

#include <cmath>

namespace afterglow::nodes {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kMeasuringPeriod = 200ms, kMeasuringDelay = 100ms;
/// Of an error, in the next one: exp(-0.2 s / 0.2 s), what follows itself within 0.2 s.
constexpr double kShared = 0.36788;

}  // namespace

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
