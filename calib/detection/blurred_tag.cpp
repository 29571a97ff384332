#include "calib/detection/blurred_tag.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace afterglow::calib {
namespace {

/// Normal distribution and its density from a table: what fitting spends most of its time on.
class NormalTable {
 public:
  NormalTable() {
    for (std::size_t i = 0; i < kEntries; ++i) {
      const double t = (double(i) - kMiddle) / kPerUnit;
      below_[i] = 0.5 * std::erfc(-t / std::sqrt(2.0));
      density_[i] = std::exp(-0.5 * t * t) / std::sqrt(2 * 3.14159265358979);
    }
  }
  struct Value {
    double below, density;
  };
  /// Off by less than 1e-5, which is a thousandth of a grey level.
  Value at(double t) const {
    const double place = std::clamp(t * kPerUnit + kMiddle, 0.0, double(kEntries) - 1.001);
    const std::size_t i = static_cast<std::size_t>(place);
    const double part = place - double(i);
    return {below_[i] + part * (below_[i + 1] - below_[i]),
            density_[i] + part * (density_[i + 1] - density_[i])};
  }

 private:
  static constexpr double kPerUnit = 64, kMiddle = 5 * kPerUnit;
  static constexpr std::size_t kEntries = std::size_t(2 * kMiddle) + 2;
  std::array<double, kEntries> below_, density_;
};
const NormalTable kNormal;

/// Share of each of the nearest cells in a blurred point, along one axis.
struct Axis {
  static constexpr int kCells = 5;
  int first;
  double share[kCells], slope[kCells], blur[kCells];
  Axis(double at, double sigma) : first(static_cast<int>(std::floor(at)) - kCells / 2) {
    double below = 0, below_slope = 0, below_blur = 0;
    for (int i = 0; i < kCells; ++i) {
      // Weight of what lies up to the cell's upper edge; the outermost stand for all beyond them.
      double upto = 1, upto_slope = 0, upto_blur = 0;
      if (i < kCells - 1) {
        const double t = (at - (first + i + 1)) / sigma;
        const NormalTable::Value normal = kNormal.at(-t);
        upto = normal.below;
        upto_slope = -normal.density / sigma;
        upto_blur = normal.density * t;
      }
      share[i] = upto - below;
      slope[i] = upto_slope - below_slope;
      blur[i] = upto_blur - below_blur;
      below = upto;
      below_slope = upto_slope;
      below_blur = upto_blur;
    }
  }
};

}  // namespace

BlurredTag::BlurredTag(const TagCells& cells, const Eigen::Vector2d& sigma_cells)
    : sigma_(sigma_cells) {
  for (auto& row : white_) row.fill(1);
  for (std::size_t row = 0; row < kTagCells; ++row) {
    for (std::size_t column = 0; column < kTagCells; ++column) {
      if (cells[row][column]) white_[row + kMargin][column + kMargin] = 0;
    }
  }
}

Whiteness BlurredTag::at(const Eigen::Vector2d& cell) const {
  const Axis x(cell.x(), sigma_.x()), y(cell.y(), sigma_.y());
  const auto first = [](int at) {
    return static_cast<std::size_t>(std::clamp(at + kMargin, 0, kSide - Axis::kCells));
  };
  const std::size_t first_row = first(y.first), first_column = first(x.first);
  Whiteness result;
  for (std::size_t row = 0; row < Axis::kCells; ++row) {
    const double* white = &white_[first_row + row][first_column];
    double along = 0, along_slope = 0, along_blur = 0;
    for (std::size_t column = 0; column < Axis::kCells; ++column) {
      along += white[column] * x.share[column];
      along_slope += white[column] * x.slope[column];
      along_blur += white[column] * x.blur[column];
    }
    result.value += y.share[row] * along;
    result.dx += y.share[row] * along_slope;
    result.dy += y.slope[row] * along;
    result.dblur += y.share[row] * along_blur + y.blur[row] * along;
  }
  return result;
}

}  // namespace afterglow::calib
