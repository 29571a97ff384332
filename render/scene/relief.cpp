#include "render/scene/relief.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "render/scene/triangulate.hpp"

namespace afterglow::render {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kMostNodes = 4e6;
/// Rays start and end this far beyond the heights, meters, so that rounding loses none of them.
constexpr double kMargin = 1e-4;

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
  for (int row = 0; row + 1 < rows; ++row) {
    for (int column = 0; column + 1 < columns; ++column) {
      if (!isKnown(column, row)) continue;
      for (const int i : {0, 1, 2, 3}) {
        const double height = place(column + i % 2, row + i / 2).z();
        least_ = std::min(least_, height);
        greatest_ = std::max(greatest_, height);
      }
    }
  }
}

bool Relief::isKnown(int column, int row) const {
  return std::isfinite(node(column, row) + node(column + 1, row) + node(column, row + 1) +
                       node(column + 1, row + 1));
}

double Relief::knownShare() const {
  int known = 0;
  for (int row = 0; row + 1 < rows_; ++row) {
    for (int column = 0; column + 1 < columns_; ++column) known += isKnown(column, row) ? 1 : 0;
  }
  return known / (double(columns_ - 1) * (rows_ - 1));
}

std::optional<Relief::Triangle> Relief::triangleAt(const Eigen::Vector2d& in_cells) const {
  if (!(in_cells.minCoeff() >= 0 && in_cells.x() <= columns_ - 1 && in_cells.y() <= rows_ - 1)) {
    return std::nullopt;
  }
  const int column = std::min(static_cast<int>(in_cells.x()), columns_ - 2);
  const int row = std::min(static_cast<int>(in_cells.y()), rows_ - 2);
  if (!isKnown(column, row)) return std::nullopt;
  return Triangle{column, row, in_cells.x() - column >= in_cells.y() - row};
}

double Relief::heightIn(const Triangle& triangle, const Eigen::Vector2d& in_cells) const {
  return mixed(triangle, in_cells,
               [this](int column, int row) { return static_cast<double>(node(column, row)); });
}

std::optional<double> Relief::height(const Eigen::Vector2d& p) const {
  const auto triangle = triangleAt(inCells(p));
  return triangle ? std::optional(heightIn(*triangle, inCells(p))) : std::nullopt;
}

/// Goes along a descending ray from triangle to triangle, from where it is as low as `highest`:
/// visit(begin, end, over_begin, over_end) returns whether to go on. Begin and end are shares of
/// the way, `over` the ray's heights over the triangle; not a number in holes.
template <typename Visit>
void Relief::follow(const Eigen::Vector3d& from, const Eigen::Vector3d& way, double highest,
                    double until, const Visit& visit) const {
  if (!(way.z() < 0) || !from.allFinite() || !way.allFinite() || least_ > greatest_) return;
  const Eigen::Vector2d start = inCells(from.head<2>()), step = way.head<2>() / cell_;
  double begin = std::max(0.0, (highest + kMargin - from.z()) / way.z());
  double end = std::min(until, (least_ - kMargin - from.z()) / way.z());
  for (int axis = 0; axis < 2; ++axis) {
    const double last = axis == 0 ? columns_ - 1 : rows_ - 1;
    if (step[axis] == 0 && (start[axis] < 0 || start[axis] > last)) return;
    if (step[axis] == 0) continue;
    const double a = -start[axis] / step[axis], b = (last - start[axis]) / step[axis];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  // The three families of the triangles' sides: whole x, whole y, whole x - y.
  const Eigen::Array3d at(start.x(), start.y(), start.x() - start.y());
  const Eigen::Array3d speed(step.x(), step.y(), step.x() - step.y());
  const Eigen::Array3d here = at + begin * speed;
  Eigen::Array3d line = (speed > 0).select(here.floor() + 1, here.ceil() - 1), next;
  for (int i = 0; i < 3; ++i) next[i] = speed[i] == 0 ? kInfinity : (line[i] - at[i]) / speed[i];
  double over_begin = kUnknown;  // where triangles meet it is the same of both
  while (begin < end) {
    int crossed = next[0] < next[1] ? 0 : 1;
    if (next[2] < next[crossed]) crossed = 2;
    const double stop = std::min(next[crossed], end);
    if (stop > begin) {
      const auto triangle = triangleAt(start + (begin + stop) / 2 * step);
      const auto over = [&](double share) {
        return from.z() + share * way.z() - heightIn(*triangle, start + share * step);
      };
      if (triangle && std::isnan(over_begin)) over_begin = over(begin);
      const double over_stop = triangle ? over(stop) : kUnknown;
      if (!visit(begin, stop, triangle ? over_begin : kUnknown, over_stop)) return;
      begin = stop;
      over_begin = over_stop;
    }
    line[crossed] += speed[crossed] > 0 ? 1 : -1;
    next[crossed] = (line[crossed] - at[crossed]) / speed[crossed];
  }
}

std::optional<Eigen::Vector3d> Relief::firstHit(const Eigen::Vector3d& from,
                                                const Eigen::Vector3d& direction) const {
  std::optional<Eigen::Vector3d> hit;
  bool was_above = from.z() > greatest_;
  follow(from, direction, greatest_, kInfinity,
         [&](double begin, double end, double over_begin, double over_end) {
           if (over_begin <= 0 && !was_above) return false;  // it came out of a hole from below
           if (over_begin <= 0 || over_end <= 0) {
             const double share = over_begin <= 0 ? 0 : over_begin / (over_begin - over_end);
             hit = from + direction * (begin + share * (end - begin));
             return false;
           }
           was_above = over_end > 0;
           return true;
         });
  return hit;
}

double Relief::clearance(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                         double touch) const {
  const Eigen::Vector3d way = to - from;
  double least = touch;
  follow(from, way, greatest_ + touch, 1 - touch / way.norm(),
         [&least](double, double, double over_begin, double over_end) {
           if (over_begin < least) least = over_begin;
           if (over_end < least) least = over_end;
           return true;
         });
  return least;
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
    heights.push_back(values.empty() ? static_cast<float>(kUnknown) : median(values));
  }
  return {low, options.cell, columns, rows, std::move(heights)};
}

}  // namespace afterglow::render
