#include "calib/solver/influence.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

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

}  // namespace afterglow::calib
