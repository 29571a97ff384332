#include "calib/landing.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::calib {
namespace {

double quantile(const std::vector<double>& sorted, double share) {
  const double rank = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(rank);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (rank - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

}  // namespace

std::optional<Eigen::Vector2d> landing(const Lens& lens, const Eigen::Vector2d& pixel,
                                       const Eigen::Isometry3d& T_optical_surface) {
  const std::optional<Eigen::Vector3d> ray = unproject(lens, pixel);
  if (!ray) return std::nullopt;
  const Eigen::Isometry3d T_surface_optical = T_optical_surface.inverse();
  const Eigen::Vector3d eye = T_surface_optical.translation();
  const Eigen::Vector3d along = T_surface_optical.linear() * *ray;
  if (std::abs(along.z()) < 1e-9 * along.norm()) return std::nullopt;
  const double way = -eye.z() / along.z();
  if (!(way > 0)) return std::nullopt;
  return Eigen::Vector2d((eye + way * along).head<2>());
}

ErrorSummary summarize(const std::vector<LandingError>& errors) {
  if (errors.empty()) return {};
  std::vector<double> mm;
  double squares = 0;
  for (const LandingError& error : errors) {
    mm.push_back(error.mm());
    squares += mm.back() * mm.back();
  }
  std::sort(mm.begin(), mm.end());
  return {static_cast<int>(mm.size()), quantile(mm, 0.5), quantile(mm, 0.95), mm.back(),
          std::sqrt(squares / static_cast<double>(mm.size()))};
}

}  // namespace afterglow::calib
