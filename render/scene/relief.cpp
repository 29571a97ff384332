#include "render/scene/relief.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

#include "render/scene/outline.hpp"

namespace afterglow::render {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr Relief::Range kNothing{std::numeric_limits<float>::infinity(),
                                 -std::numeric_limits<float>::infinity(), false};
constexpr double kMostNodes = 4e6;
constexpr std::size_t kBlock = 3;  // the level whose cells are passed over at once: 8 x 8
/// Rays start and end this far beyond the heights, meters, so that rounding loses none of them.
constexpr double kMargin = 1e-4;

Relief::Range together(const Relief::Range& a, const Relief::Range& b) {
  return {std::min(a.least, b.least), std::max(a.greatest, b.greatest),
          a.is_complete && b.is_complete};
}

float median(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

Relief::Relief(const Eigen::Vector2d& origin, double cell, int columns, int rows,
               std::vector<float> heights)
    : origin_(origin), cell_(cell), columns_(columns), rows_(rows), heights_(std::move(heights)) {
  if (!(cell > 0) || columns < 2 || rows < 2 ||
      heights_.size() != static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {
    throw std::logic_error("a relief needs at least 2 x 2 nodes and a height for each");
  }
  addLevels();
}

float Relief::node(int column, int row) const {
  return heights_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(column)];
}

void Relief::addLevels() {
  Level level{columns_ - 1, rows_ - 1, {}};
  for (int row = 0; row < level.rows; ++row) {
    for (int column = 0; column < level.columns; ++column) {
      const float a = node(column, row), b = node(column + 1, row);
      const float c = node(column, row + 1), d = node(column + 1, row + 1);
      const bool known = std::isfinite(a + b + c + d);
      level.cells.push_back(known ? Range{std::min({a, b, c, d}), std::max({a, b, c, d}), true}
                                  : kNothing);
    }
  }
  levels_.push_back(std::move(level));
  while (levels_.back().cells.size() > 1) {
    const Level& fine = levels_.back();
    Level coarse{(fine.columns + 1) / 2, (fine.rows + 1) / 2, {}};
    coarse.cells.assign(static_cast<std::size_t>(coarse.columns * coarse.rows),
                        {kNothing.least, kNothing.greatest, true});
    for (int row = 0; row < fine.rows; ++row) {
      for (int column = 0; column < fine.columns; ++column) {
        Range& into = coarse.cells[static_cast<std::size_t>(row / 2 * coarse.columns + column / 2)];
        into = together(into, fine.cells[static_cast<std::size_t>(row * fine.columns + column)]);
      }
    }
    levels_.push_back(std::move(coarse));
  }
}

double Relief::knownShare() const {
  const std::vector<Range>& cells = levels_.front().cells;
  const auto known =
      std::count_if(cells.begin(), cells.end(), [](const Range& cell) { return cell.is_complete; });
  return static_cast<double>(known) / static_cast<double>(cells.size());
}

double Relief::heightInCell(int column, int row, const Eigen::Vector2d& grid) const {
  const double a = grid.x() - column, b = grid.y() - row;
  return (node(column, row) * (1 - a) + node(column + 1, row) * a) * (1 - b) +
         (node(column, row + 1) * (1 - a) + node(column + 1, row + 1) * a) * b;
}

std::optional<double> Relief::height(const Eigen::Vector2d& p) const {
  const Eigen::Vector2d grid = (p - origin_) / cell_;
  if (!(grid.minCoeff() >= 0 && grid.x() <= columns_ - 1 && grid.y() <= rows_ - 1)) {
    return std::nullopt;
  }
  const double height = heightInCell(std::min(static_cast<int>(grid.x()), columns_ - 2),
                                     std::min(static_cast<int>(grid.y()), rows_ - 2), grid);
  return std::isfinite(height) ? std::optional(height) : std::nullopt;
}

Eigen::Vector3d Relief::spot(int column, int row, const Eigen::Vector2d& share) const {
  const Eigen::Vector2d grid = Eigen::Vector2d(column, row) + share;
  const Eigen::Vector2d p = origin_ + cell_ * grid;
  return {p.x(), p.y(), heightInCell(column, row, grid)};
}

const Relief::Range& Relief::cellRange(int column, int row) const {
  return levels_.front()
      .cells[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_ - 1) +
             static_cast<std::size_t>(column)];
}

Relief::Range Relief::range(const Eigen::Vector2d& low, const Eigen::Vector2d& high) const {
  const Eigen::Vector2d last(columns_ - 2, rows_ - 2);
  const Eigen::Array2d from = ((low - origin_) / cell_).array().floor();
  const Eigen::Array2d to = ((high - origin_) / cell_).array().floor();
  if (!((to >= 0).all() && (from <= last.array()).all())) return kNothing;
  const bool is_within = (from >= 0).all() && (to <= last.array()).all();
  const Eigen::Array2i a = from.max(0).cast<int>(), b = to.min(last.array()).cast<int>();
  int level = 0;
  while ((b.x() >> level) - (a.x() >> level) > 1 || (b.y() >> level) - (a.y() >> level) > 1) {
    ++level;
  }
  const Level& cells = levels_[static_cast<std::size_t>(level)];
  Range all{kNothing.least, kNothing.greatest, is_within};
  for (int row = a.y() >> level; row <= b.y() >> level; ++row) {
    for (int column = a.x() >> level; column <= b.x() >> level; ++column) {
      all = together(all, cells.cells[static_cast<std::size_t>(row * cells.columns + column)]);
    }
  }
  return all;
}

/// A ray's way through one cell, as shares of its direction.
struct Relief::Step {
  Eigen::Vector3d from, direction;  ///< x and y in cells, z meters
  int column, row;
  double begin, end;
};

/// Over a bilinear cell the ray's height is a quadratic function of its way: three samples tell it.
std::optional<double> Relief::hitInCell(const Step& step, bool was_above, bool& is_lost) const {
  const auto over = [&](double share) {
    const Eigen::Vector3d p = step.from + step.direction * share;
    return p.z() - heightInCell(step.column, step.row, p.head<2>());
  };
  const double f0 = over(step.begin);
  if (f0 <= 0) {
    is_lost = !was_above;
    return step.begin;
  }
  const double fm = over((step.begin + step.end) / 2), f1 = over(step.end);
  const double a = 2 * f0 - 4 * fm + 2 * f1, b = -3 * f0 + 4 * fm - f1;
  const double discriminant = b * b - 4 * a * f0;
  if (discriminant < 0) return std::nullopt;
  // Of both roots, stable whatever a: the first one that lies on the way.
  const double q = -(b + std::copysign(std::sqrt(discriminant), b)) / 2;
  double first = kInfinity;
  for (const double root : {q / a, f0 / q}) {
    if (root >= 0 && root <= 1) first = std::min(first, root);
  }
  if (first == kInfinity) return std::nullopt;
  return step.begin + first * (step.end - step.begin);
}

/// Over a block of cells that are all lower and known, in one step.
bool Relief::passOver(Step& step) const {
  if (levels_.size() <= kBlock) return false;
  const Level& blocks = levels_[kBlock];
  const Eigen::Array2i cell(step.column, step.row), block(cell / (1 << kBlock));
  const Range& range =
      blocks.cells[static_cast<std::size_t>(block.y() * blocks.columns + block.x())];
  if (!range.is_complete) return false;
  double end = kInfinity;
  int axis = 0;
  for (int i = 0; i < 2; ++i) {
    const double d = step.direction[i];
    if (d == 0) continue;
    const double border = (block[i] + (d > 0 ? 1 : 0)) * (1 << kBlock);
    const double share = (border - step.from[i]) / d;
    if (share < end) axis = i;
    end = std::min(end, share);
  }
  if (!(end > step.begin && end < kInfinity)) return false;
  if (step.from.z() + step.direction.z() * end <= range.greatest) return false;
  const bool is_upwards = step.direction[axis] > 0;
  const double other = step.from[1 - axis] + step.direction[1 - axis] * end;
  const int along = (block[axis] + (is_upwards ? 1 : 0)) * (1 << kBlock) - (is_upwards ? 0 : 1);
  const int low = block[1 - axis] * (1 << kBlock);
  const int across = std::clamp(static_cast<int>(std::floor(other)), low, low + (1 << kBlock) - 1);
  step.begin = end;
  step.column = axis == 0 ? along : across;
  step.row = axis == 0 ? across : along;
  return true;
}

std::optional<Eigen::Vector3d> Relief::firstHit(const Eigen::Vector3d& from,
                                                const Eigen::Vector3d& direction) const {
  bool is_lost = false;
  const auto stop = firstStop(from, direction, kInfinity, is_lost);
  if (!stop || is_lost) return std::nullopt;
  return Eigen::Vector3d(from + direction * *stop);
}

bool Relief::isInTheWay(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                        double touch) const {
  const Eigen::Vector3d way = to - from;
  bool is_lost = false;
  return firstStop(from, way, 1 - touch / way.norm(), is_lost).has_value();
}

/// As a share of the direction, less than `until`. Lost: the ray came out of a hole below what is
/// known beside it.
std::optional<double> Relief::firstStop(const Eigen::Vector3d& from,
                                        const Eigen::Vector3d& direction, double until,
                                        bool& is_lost) const {
  if (range().isEmpty() || !(direction.z() < 0)) return std::nullopt;
  Step step{from, direction, 0, 0, 0, 0};
  step.from.head<2>() = (from.head<2>() - origin_) / cell_;
  step.direction.head<2>() /= cell_;
  // Where the ray is among the heights and over the grid.
  step.begin = std::max(0.0, (range().greatest + kMargin - from.z()) / direction.z());
  double end = std::min(until, (range().least - kMargin - from.z()) / direction.z());
  for (int axis = 0; axis < 2; ++axis) {
    const double last = axis == 0 ? columns_ - 1 : rows_ - 1;
    double in = -step.from[axis] / step.direction[axis];
    double out = (last - step.from[axis]) / step.direction[axis];
    if (step.direction[axis] == 0) {
      if (step.from[axis] < 0 || step.from[axis] > last) return std::nullopt;
      continue;
    }
    if (in > out) std::swap(in, out);
    step.begin = std::max(step.begin, in);
    end = std::min(end, out);
  }
  if (!(step.begin < end)) return std::nullopt;

  const Eigen::Vector3d start = step.from + step.direction * step.begin;
  step.column = std::clamp(static_cast<int>(std::floor(start.x())), 0, columns_ - 2);
  step.row = std::clamp(static_cast<int>(std::floor(start.y())), 0, rows_ - 2);
  const auto border = [&](int axis, int index) {
    const double d = step.direction[axis];
    return d == 0 ? kInfinity : (index + (d > 0 ? 1 : 0) - step.from[axis]) / d;
  };
  bool was_above = from.z() > range().greatest;
  while (step.begin < end && step.column >= 0 && step.column < columns_ - 1 && step.row >= 0 &&
         step.row < rows_ - 1) {
    if (passOver(step)) {
      was_above = true;
      continue;
    }
    const double next_x = border(0, step.column), next_y = border(1, step.row);
    step.end = std::max(step.begin, std::min({next_x, next_y, end}));
    const bool is_known = cellRange(step.column, step.row).is_complete;
    if (is_known) {
      const auto hit = hitInCell(step, was_above, is_lost);
      if (hit) return hit;
    }
    was_above = is_known;
    step.begin = step.end;
    if (next_x <= next_y) {
      step.column += step.direction.x() > 0 ? 1 : -1;
    } else {
      step.row += step.direction.y() > 0 ? 1 : -1;
    }
  }
  return std::nullopt;
}

Relief reliefFromPoints(const std::vector<Eigen::Vector3d>& points,
                        const std::vector<Eigen::Vector2d>& polygon, const ReliefOptions& options) {
  const auto counts = [&](const Eigen::Vector3d& p) {
    return p.allFinite() && p.z() >= options.least && p.z() <= options.greatest &&
           (polygon.empty() || isInside(polygon, p.head<2>()));
  };
  std::vector<Eigen::Vector3d> inside;
  std::copy_if(points.begin(), points.end(), std::back_inserter(inside), counts);
  if (inside.empty()) throw std::runtime_error("no points near the surface within its outline");
  Eigen::Array2d low = inside.front().head<2>(), high = low;
  for (const Eigen::Vector3d& p : inside) {
    low = low.min(p.head<2>().array());
    high = high.max(p.head<2>().array());
  }
  const Eigen::Array2d size = ((high - low) / options.cell).round() + 1;
  if (!(size.prod() <= kMostNodes)) throw std::runtime_error("too large for so small cells");
  if (size.minCoeff() < 2) throw std::runtime_error("smaller than a cell");
  const int columns = static_cast<int>(size.x()), rows = static_cast<int>(size.y());
  std::vector<std::vector<float>> found(static_cast<std::size_t>(columns * rows));
  for (const Eigen::Vector3d& p : inside) {
    const Eigen::Array2i at = ((p.head<2>().array() - low) / options.cell).round().cast<int>();
    found[static_cast<std::size_t>(at.y() * columns + at.x())].push_back(static_cast<float>(p.z()));
  }
  std::vector<float> heights;
  for (std::vector<float>& values : found) {
    heights.push_back(values.empty() ? kUnknown : median(values));
  }
  return {low, options.cell, columns, rows, std::move(heights)};
}

}  // namespace afterglow::render
