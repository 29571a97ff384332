#include "render/scene/relief_sight.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::render {
namespace {

constexpr std::uint32_t kNotYet = ~std::uint32_t{0};
constexpr std::uint32_t kNothing = 0, kAll = 1;

}  // namespace

void ReliefSight::begin(const std::shared_ptr<const Relief>& relief, const Eigen::Vector3d& from) {
  if (relief_ == relief && from_ == from) return;
  relief_ = relief;
  from_ = from;
  const auto cells = static_cast<std::size_t>(relief->columns() - 1) *
                     static_cast<std::size_t>(relief->rows() - 1);
  views_.assign(cells, kNotYet);
  looks_.assign({Corners(), Corners().set()});
}

ReliefSight::Corners ReliefSight::seen(int column, int row) {
  std::uint32_t& view =
      views_[static_cast<std::size_t>(row) * static_cast<std::size_t>(relief_->columns() - 1) +
             static_cast<std::size_t>(column)];
  if (view == kNotYet) {
    const Corners corners = look(column, row);
    view = corners.all() ? kAll : corners.none() ? kNothing : std::uint32_t(looks_.size());
    if (view == looks_.size()) looks_.push_back(corners);
  }
  return looks_[view];
}

ReliefSight::Corners ReliefSight::look(int column, int row) const {
  Corners corners;
  if (isSurelySeen(column, row)) return corners.set();
  const auto lookAt = [&](int step) {
    std::size_t looks = 0;
    for (int y = 0; y <= kParts; y += step) {
      for (int x = 0; x <= kParts; x += step, ++looks) {
        const Eigen::Vector3d spot =
            relief_->spot(column, row, Eigen::Vector2d(x, y) / double{kParts});
        corners[index(x, y)] = !relief_->isInTheWay(from_, spot, kTouch);
      }
    }
    return looks;
  };
  const std::size_t looks = lookAt(kParts / 2);
  if (corners.count() == looks) return corners.set();
  if (corners.any()) lookAt(1);
  return corners;
}

/// From the cell towards the place, in boxes that grow: whether all that stands in one is lower
/// than all ways through it.
bool ReliefSight::isSurelySeen(int column, int row) const {
  const double least = static_cast<double>(relief_->cellRange(column, row).least);
  const Eigen::Vector2d near = relief_->spot(column, row, {0, 0}).head<2>();
  const Eigen::Vector2d far = relief_->spot(column, row, {1, 1}).head<2>();
  const Eigen::Vector2d from = from_.head<2>();
  const double rise = from_.z() - least;
  if (!(rise > 0)) return false;
  const auto height = [&](double share) { return least + share * rise; };
  // The longest way has the least share within kTouch.
  const Eigen::Vector2d across = (near - from).cwiseAbs().cwiseMax((far - from).cwiseAbs());
  double share = kTouch / std::hypot(across.x(), across.y(), rise);
  while (share < 1 && height(share) <= static_cast<double>(relief_->range().greatest)) {
    const double next = std::min(1.0, 2 * share);
    Eigen::Array2d low = near + share * (from - near), high = low;
    for (const double at : {share, next}) {
      for (const Eigen::Vector2d& corner : {near, far}) {
        const Eigen::Array2d p = corner + at * (from - corner);
        low = low.min(p);
        high = high.max(p);
      }
    }
    if (static_cast<double>(relief_->range(low, high).greatest) >= height(share)) return false;
    share = next;
  }
  return true;
}

}  // namespace afterglow::render
