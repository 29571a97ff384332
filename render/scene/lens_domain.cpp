#include "render/scene/lens_domain.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace afterglow::render {
namespace {

constexpr int kFoldSides = 96;

Eigen::Vector2d unit(double angle) { return {std::cos(angle), std::sin(angle)}; }

}  // namespace

LensDomain::LensDomain(const calib::Lens& lens)
    : focal_(lens.K(0, 0), lens.K(1, 1)),
      fold_inner_radius_(lens.fold_radius * std::cos(M_PI / kFoldSides)) {
  if (std::isfinite(lens.fold_radius)) {
    for (int i = 0; i < kFoldSides; ++i) fold_normals_.push_back(unit(2 * M_PI * i / kFoldSides));
  }
  measureBox(lens);
  if (lens.model == calib::LensModel::Equidistant) {
    fisheye_ = lens;
  } else if (std::any_of(lens.D.begin(), lens.D.end(), [](double d) { return d != 0; })) {
    measureBend(lens);
  }
}

/// The border's rays; where a border pixel has no ray, the fold lies within the image.
void LensDomain::measureBox(const calib::Lens& lens) {
  constexpr int kSamples = 64;
  constexpr double kMargin = 16;  // px; covers the border's bulge between samples
  min_ = Eigen::Vector2d::Constant(1e3);
  max_ = -min_;
  const Eigen::Vector2d first = Eigen::Vector2d::Constant(-kMargin);
  const Eigen::Vector2d last(lens.width - 1 + kMargin, lens.height - 1 + kMargin);
  bool complete = true;
  const auto include = [&](double u, double v) {
    const auto ray = calib::unproject(lens, {u, v});
    complete = complete && ray.has_value();
    if (!ray) return;
    min_ = min_.cwiseMin(ray->head<2>());
    max_ = max_.cwiseMax(ray->head<2>());
  };
  for (int i = 0; i <= kSamples; ++i) {
    const Eigen::Vector2d at = first + (last - first) * i / kSamples;
    include(at.x(), first.y());
    include(at.x(), last.y());
    include(first.x(), at.y());
    include(last.x(), at.y());
  }
  if (complete) return;
  max_ = Eigen::Vector2d::Constant(std::min(lens.fold_radius, 1e3));
  min_ = -max_;
}

/// An edge of length L (px, before distortion) sags by at most bend L^2 / 8, bend being the
/// largest second derivative of distorted by undistorted pixels along it.
void LensDomain::measureBend(const calib::Lens& lens) {
  constexpr int kRadii = 64, kAngles = 16, kDirections = 8;
  constexpr double kStep = 1e-4;
  const double corner = min_.cwiseAbs().cwiseMax(max_.cwiseAbs()).norm();
  radius_step_ = std::min(corner, lens.fold_radius) / (kRadii - 1);
  double bend = 0;  // the largest so far: an edge reaches from its outer end inwards
  for (int i = 0; i < kRadii; ++i) {
    for (int j = 0; j < kAngles * kDirections; ++j) {
      const Eigen::Vector2d n = i * radius_step_ * unit(2 * M_PI * (j / kDirections) / kAngles);
      const Eigen::Vector2d step = kStep * unit(M_PI * (j % kDirections) / kDirections);
      const Eigen::Vector2d second = calib::distort(lens, n + step) - 2 * calib::distort(lens, n) +
                                     calib::distort(lens, n - step);
      bend = std::max(bend,
                      second.cwiseProduct(focal_).norm() / step.cwiseProduct(focal_).squaredNorm());
    }
    max_square_length_.push_back(bend > 1e-12 ? 8 * kMaxSag / bend : 1e18);
  }
}

/// Returns true if a fisheye shows the edge straight. Content of a fisheye reaches far out before
/// the lens and bends less and less there: a bound by radius would ask for a hundred times the
/// splits. Measured instead, at three places that are evenly spaced as the lens sees them; an edge
/// whose bend turns between would pass through the center, and be straight.
bool LensDomain::isStraightInFisheye(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const {
  constexpr double kMaxShift = 1;  // px along the edge: there only depths between vertices suffer
  const auto pixel = [this](const Eigen::Vector2d& n) -> Eigen::Vector2d {
    return calib::distort(*fisheye_, n).cwiseProduct(focal_);
  };
  const auto between = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) -> Eigen::Vector2d {
    return (a.homogeneous().normalized() + b.homogeneous().normalized()).hnormalized();
  };
  const Eigen::Vector2d begin = pixel(from), along = pixel(to) - begin, middle = between(from, to);
  const double length = along.norm(), before = (to - from).norm();
  if (length < 1e-9 || before < 1e-9) return true;
  for (const Eigen::Vector2d& n : {between(from, middle), middle, between(middle, to)}) {
    const Eigen::Vector2d at = pixel(n) - begin;
    const double sag = std::abs(along.x() * at.y() - along.y() * at.x()) / length;
    const double shift = along.dot(at) / length - (n - from).norm() / before * length;
    if (sag > kMaxSag || std::abs(shift) > kMaxShift) return false;
  }
  return true;
}

bool LensDomain::isStraight(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const {
  if (fisheye_) return isStraightInFisheye(from, to);
  if (max_square_length_.empty()) return true;
  return isStraight((to - from).cwiseProduct(focal_).squaredNorm(),
                    std::sqrt(std::max(from.squaredNorm(), to.squaredNorm())));
}

bool LensDomain::isStraightWithin(const Eigen::Vector2d& low, const Eigen::Vector2d& high) const {
  if (fisheye_) return false;  // no bound is known: each edge is measured
  if (max_square_length_.empty()) return true;
  return isStraight((high - low).cwiseProduct(focal_).squaredNorm(),
                    low.cwiseAbs().cwiseMax(high.cwiseAbs()).norm());
}

bool LensDomain::isStraight(double square_length, double radius) const {
  const auto bin = static_cast<std::size_t>(radius / radius_step_) + 1;
  return square_length <= max_square_length_[std::min(bin, max_square_length_.size() - 1)];
}

}  // namespace afterglow::render
