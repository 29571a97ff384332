#include "calib/detection/ray_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace afterglow::calib {
namespace {

constexpr double kSpacing_px = 4;
constexpr double kNoRay = std::numeric_limits<double>::quiet_NaN();

}  // namespace

RayMap::RayMap(const Lens& lens)
    : columns_(static_cast<int>(std::ceil(lens.width / kSpacing_px)) + 3),
      rows_(static_cast<int>(std::ceil(lens.height / kSpacing_px)) + 3) {
  rays_.reserve(std::size_t(columns_) * std::size_t(rows_));
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const auto ray = unproject(lens, kSpacing_px * Eigen::Vector2d(column - 1, row - 1));
      rays_.push_back(ray ? Eigen::Vector2d(ray->head<2>()) : Eigen::Vector2d(kNoRay, kNoRay));
    }
  }
}

Eigen::Vector2d RayMap::ray(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d at = pixel / kSpacing_px + Eigen::Vector2d(1, 1);
  const int column = std::clamp(static_cast<int>(std::floor(at.x())), 0, columns_ - 2);
  const int row = std::clamp(static_cast<int>(std::floor(at.y())), 0, rows_ - 2);
  const double a = at.x() - column, b = at.y() - row;
  const auto grid = [&](int r, int c) -> const Eigen::Vector2d& {
    return rays_[std::size_t(r) * std::size_t(columns_) + std::size_t(c)];
  };
  return (1 - b) * ((1 - a) * grid(row, column) + a * grid(row, column + 1)) +
         b * ((1 - a) * grid(row + 1, column) + a * grid(row + 1, column + 1));
}

}  // namespace afterglow::calib
