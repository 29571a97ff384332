#include "calib/solver/influence.hpp"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>

namespace afterglow::calib {
namespace {

/// The inverse over the free rows and columns; held ones are zero.
std::optional<SharedMatrix> inverseOf(const SharedMatrix& information,
                                      const std::array<bool, kSharedSize>& is_free) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < kSharedSize; ++i) {
    if (is_free[std::size_t(i)]) rows.push_back(i);
  }
  const auto size = Eigen::Index(rows.size());
  // In units in which every parameter is known to 1, so that the pivots can be compared.
  Eigen::MatrixXd some(size, size);
  Eigen::VectorXd unit(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    const double diagonal = information(rows[std::size_t(i)], rows[std::size_t(i)]);
    if (!(diagonal > 0)) return std::nullopt;
    unit[i] = 1 / std::sqrt(diagonal);
  }
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index k = 0; k < size; ++k) {
      some(i, k) = unit[i] * unit[k] * information(rows[std::size_t(i)], rows[std::size_t(k)]);
    }
  }
  const Eigen::LDLT<Eigen::MatrixXd> factors(some);
  constexpr double kNothing = 1e-13;
  if (!(factors.vectorD().array() > kNothing).all()) return std::nullopt;
  const Eigen::MatrixXd inverse = factors.solve(Eigen::MatrixXd::Identity(size, size));
  SharedMatrix all = SharedMatrix::Zero();
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index k = 0; k < size; ++k) {
      all(rows[std::size_t(i)], rows[std::size_t(k)]) = unit[i] * unit[k] * inverse(i, k);
    }
  }
  return all;
}

SharedMatrix sumOf(const std::vector<Influence::OfView>& views) {
  SharedMatrix sum = SharedMatrix::Zero();
  for (const Influence::OfView& view : views) sum += view.information;
  return sum;
}

}  // namespace

std::optional<SharedMatrix> Influence::covariance(double dispersion) const {
  const SharedMatrix seen = sumOf(views);
  const auto inverse = inverseOf(seen + prior, is_free);
  if (!inverse) return std::nullopt;
  return SharedMatrix(*inverse * (dispersion * seen + prior) * *inverse);
}

SharedVector Influence::moveWithout(std::size_t view) const {
  const auto inverse = inverseOf(sumOf(views) + prior - views[view].information, is_free);
  if (!inverse) return SharedVector::Zero();
  return *inverse * views[view].score;
}

double Influence::dispersion(const SharedMatrix& importance) const {
  const auto inverse = inverseOf(sumOf(views) + prior, is_free);
  if (!inverse) return 1;
  const SharedMatrix weight = *inverse * importance * *inverse;
  double seen = 0, expected = 0;
  for (const OfView& view : views) {
    seen += view.score.dot(weight * view.score);
    // At the solution a view's score is smaller than its noise: the solution followed it.
    const SharedMatrix left = view.information - view.information * *inverse * view.information;
    expected += (weight * left).trace();
  }
  return expected > 0 ? std::max(1.0, seen / expected) : 1;
}

namespace {

constexpr double kDistances_m[] = {1, 2, 3};
constexpr int kBeamColumns = 16, kBeamRows = 10, kDraws = 400;
constexpr double kCertain = 0.95;
/// The margin of the camera's picture, whose outermost pixels no board reaches.
constexpr double kMargin = 1.0 / 64;

bool sees(const Lens& camera, const Eigen::Vector3d& p_camera) {
  const auto pixel = project(camera, p_camera);
  const double margin = kMargin * camera.width;
  return pixel && pixel->minCoeff() > margin && pixel->x() < camera.width - margin &&
         pixel->y() < camera.height - margin;
}

double quantile(std::vector<double>& values, double share) {
  const auto at = values.begin() + std::ptrdiff_t(double(values.size() - 1) * share);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Student's t instead of the normal distribution: the ratio of the two at 95 %.
double studentRatio(int degrees) {
  const double n = std::max(2, degrees);
  return 1 + 1.2 / n + 1.7 / (n * n);
}

}  // namespace

Beam::Beam(const ProjectorEstimate& estimate, const Lens& camera)
    : focal_px_(estimate.projector.K(0, 0)) {
  const Lens& lens = estimate.projector;
  for (double distance : kDistances_m) {
    Places places;
    places.distance_m = distance;
    for (int i = 0; i < (kBeamColumns + 1) * (kBeamRows + 1); ++i) {
      const Eigen::Vector2d pixel(double(i % (kBeamColumns + 1)) / kBeamColumns * (lens.width - 1),
                                  double(i / (kBeamColumns + 1)) / kBeamRows * (lens.height - 1));
      const auto ray = unproject(lens, pixel);
      if (!ray) continue;
      const Eigen::Vector3d p_camera = estimate.T_camera_projector * (*ray * distance);
      if (!sees(camera, p_camera)) continue;
      const auto slope = pixelSlopes(estimate, p_camera);
      if (slope) places.mm.push_back(*slope * (1000 * distance / focal_px_));
    }
    if (!places.mm.empty()) by_distance_.push_back(places);
  }
}

SharedMatrix Beam::importance() const {
  Eigen::Matrix<double, kCalibrationParameters, kCalibrationParameters> sum =
      decltype(sum)::Zero();
  double count = 0;
  for (const Places& places : by_distance_) {
    for (const Slope& slope : places.mm) sum += slope.transpose() * slope;
    count += double(places.mm.size());
  }
  SharedMatrix importance = SharedMatrix::Zero();
  for (Eigen::Index i = 0; i < kCalibrationParameters; ++i) {
    for (Eigen::Index k = 0; k < kCalibrationParameters; ++k) {
      importance(sharedIndex(i), sharedIndex(k)) = sum(i, k) / std::max(1.0, count);
    }
  }
  return importance;
}

std::vector<double> Beam::spread_mm(const ProjectorEstimate& estimate) const {
  using Parameters = Eigen::Matrix<double, kCalibrationParameters, 1>;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(estimate.covariance);
  const Eigen::MatrixXd root =
      axes.eigenvectors() * axes.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<std::vector<double>> drawn(by_distance_.size());
  for (int draw = 0; draw < kDraws; ++draw) {
    Parameters deviations;
    for (Eigen::Index i = 0; i < deviations.size(); ++i) deviations[i] = normal(random);
    const Parameters off = root * deviations;
    for (std::size_t i = 0; i < by_distance_.size(); ++i) {
      std::vector<double> mm;
      for (const Slope& slope : by_distance_[i].mm) mm.push_back((slope * off).norm());
      drawn[i].push_back(quantile(mm, kCertain));
    }
  }
  std::vector<double> spread;
  for (std::vector<double>& mm : drawn) spread.push_back(quantile(mm, kCertain));
  return spread;
}

std::vector<LightError> Beam::errors(const ProjectorEstimate& estimate,
                                     const ProjectorEstimate& at_best, int views) const {
  const std::vector<double> spread = spread_mm(estimate), bound = spread_mm(at_best);
  std::vector<LightError> errors;
  for (std::size_t i = 0; i < by_distance_.size(); ++i) {
    const double distance = by_distance_[i].distance_m;
    const double mm = studentRatio(views - 1) * spread[i];
    errors.push_back({distance, mm, mm * focal_px_ / (1000 * distance), bound[i]});
  }
  return errors;
}

}  // namespace afterglow::calib
