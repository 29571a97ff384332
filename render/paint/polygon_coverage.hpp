/// \file
/// The exact share of every pixel that an outline covers.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "render/paint/band_bins.hpp"
#include "render/paint/canvas.hpp"
#include "render/paint/float_lens.hpp"

namespace afterglow::render {

/// After an outline's corners the first follows once more, and room to be read: so many edges at
/// once.
constexpr std::size_t kCornersMore = kPixelsAtOnce;

/// Sums what each edge covers to its right, as font rasterizers do ("signed area coverage"): two
/// triangles that share an edge share its pixels without gap or overlap. Float arithmetic: shares
/// are right to about 1e-5. Keeps its buffer.
class PolygonCoverage {
 public:
  explicit PolygonCoverage(int width)
      : width_(width),
        sums_((static_cast<std::size_t>(width) + kMore) * kBandRows),
        shares_(static_cast<std::size_t>(width) + kPixelsAtOnce) {}

  /// The way in which corners make an outline.
  enum class Outline {
    Polygon,  ///< a line from each corner to the next, and from the last to the first
    Edges,    ///< any: every two corners are an edge, all turning the same way around the inside
  };

  /// px; corners farther out, or not a number, are not drawn: no integer could hold them.
  static constexpr float kFarthest = 1e7f;

  /// Calls visit(row, column, count, const float* shares) for each row in [row_begin, row_end),
  /// which are at most kBandRows, that is touched. Shares are positive if the outline turns
  /// clockwise as seen (y down), else negative; after them come zeros, up to kPixelsAtOnce.
  template <typename Visit>
  void visit(const Corner* corners, std::size_t corner_count, Outline outline, int row_begin,
             int row_end, const Visit& visit) {
    float top = corners[0].y, bottom = corners[0].y;
    for (std::size_t i = 0; i < corner_count; ++i) {
      if (!(std::abs(corners[i].x) < kFarthest && std::abs(corners[i].y) < kFarthest)) return;
      top = std::min(top, corners[i].y);
      bottom = std::max(bottom, corners[i].y);
    }
    if (!(bottom > static_cast<float>(row_begin) && top < static_cast<float>(row_end))) return;
    const int first = std::max(row_begin, static_cast<int>(top));
    const int last = std::min(row_end - 1, static_cast<int>(bottom));
    for (int row = first; row <= last; ++row) spans_[at(row - first)] = {width_, 0};
    const bool is_polygon = outline == Outline::Polygon;
    for (std::size_t i = 0; i < corner_count; i += is_polygon ? 1 : 2) {
      addEdge(corners[i], corners[i + 1 < corner_count ? i + 1 : 0], first, last);
    }
    for (int row = first; row <= last; ++row) {
      const Span span = spans_[at(row - first)];
      if (span.begin >= span.end) continue;
      float* sums = sumsOf(row - first);
      const int count = span.end - span.begin;
      float share = 0;
      for (int i = 0; i < count; ++i) {
        shares_[at(i)] = share += sums[span.begin + i];
        sums[span.begin + i] = 0;
      }
      sums[span.end] = sums[span.end + 1] = 0;  // what is left of the last columns' edges
      std::fill_n(&shares_[at(count)], kPixelsAtOnce, 0.f);
      visit(row, span.begin, count, static_cast<const float*>(shares_.data()));
    }
  }

 private:
  struct Span {
    int begin, end;
  };
  /// A slice of an edge, within a row.
  struct Slice {
    float left, right;
    float height;  ///< height of the row
    float by_x;    ///< height by breadth
    float sign;    ///< -1: the edge runs down
  };

  static constexpr std::size_t kMore = 3;  ///< columns, for what the last ones hand on

  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  float* sumsOf(int row) { return sums_.data() + at(row) * (at(width_) + kMore); }

  void addEdge(const Corner& a, const Corner& b, int first, int last) {
    const bool is_up = b.y < a.y;
    const Corner& high = is_up ? b : a;
    const Corner& low = is_up ? a : b;
    if (low.y <= static_cast<float>(first) || high.y > static_cast<float>(last + 1)) return;
    if (!(low.y > high.y)) return;
    const float slope = (low.x - high.x) / (low.y - high.y), by_x = 1 / std::abs(slope);
    const bool is_inside =
        std::min(low.x, high.x) >= 0 && std::max(low.x, high.x) < static_cast<float>(width_);
    const int begin = std::max(first, static_cast<int>(std::max(high.y, 0.f)));
    const int end = std::min(last, static_cast<int>(low.y));
    for (int row = begin; row <= end; ++row) {
      const float top = std::max(high.y, static_cast<float>(row));
      const float bottom = std::min(low.y, static_cast<float>(row + 1));
      if (!(bottom > top)) continue;
      const float from = high.x + (top - high.y) * slope;
      const float to = high.x + (bottom - high.y) * slope;
      const Slice slice{std::min(from, to), std::max(from, to), bottom - top, by_x,
                        is_up ? 1.f : -1.f};
      Span& span = spans_[at(row - first)];
      is_inside ? addSlice(slice, span, sumsOf(row - first))
                : addInside(slice, span, sumsOf(row - first));
    }
  }

  /// Parts beyond the image's sides count there as far as they matter to the image.
  void addInside(Slice slice, Span& span, float* sums) const {
    const auto width = static_cast<float>(width_);
    if (slice.left >= width) {
      span.end = width_;
      return;
    }
    if (slice.right > width) {
      const float inside = (width - slice.left) / (slice.right - slice.left);
      span.end = width_;
      slice.height *= inside;
      slice.right = width;
    }
    if (slice.left < 0) {
      const float outside = slice.right <= 0 ? 1 : -slice.left / (slice.right - slice.left);
      span.begin = 0;
      span.end = std::max(span.end, 1);
      sums[0] += slice.sign * slice.height * outside;
      if (slice.right <= 0) return;
      slice.height *= 1 - outside;
      slice.left = 0;
    }
    addSlice(slice, span, sums);
  }

  void addSlice(const Slice& slice, Span& span, float* sums) const {
    const int first = static_cast<int>(slice.left), last = static_cast<int>(slice.right);
    span.begin = std::min(span.begin, first);
    span.end = std::max(span.end, std::min(last + 1, width_));
    if (last > first + 1) return addWide(slice, first, last, sums);
    // One column or two, without a branch that nobody could foresee.
    const auto border = static_cast<float>(first + 1);
    const float breadth = slice.right - slice.left, in_first = border - slice.left;
    const float breadth_first = std::min(breadth, in_first), breadth_next = breadth - breadth_first;
    const float height = slice.sign * slice.height;
    const float height_first = slice.sign * std::min(slice.height, in_first * slice.by_x);
    const float height_next = height - height_first;
    const float beside = height_first * (1 - in_first + 0.5f * breadth_first);
    const float beyond = height_next * 0.5f * breadth_next;
    sums[first] += height_first - beside;
    sums[first + 1] += beside + height_next - beyond;
    sums[first + 2] += beyond;
  }

  /// Covered of a column: the mean height of the edge over it, from `left` on.
  static void addWide(const Slice& slice, int first, int last, float* sums) {
    const float height = slice.sign * slice.height, by_x = slice.sign * slice.by_x;
    const float in_first = static_cast<float>(first + 1) - slice.left;
    float before = 0.5f * by_x * in_first * in_first;
    sums[first] += before;
    for (int i = first + 1; i < last; ++i) {
      const float here = by_x * (static_cast<float>(i) + 0.5f - slice.left);
      sums[i] += here - before;
      before = here;
    }
    const float in_last = slice.right - static_cast<float>(last);
    const float here = height - 0.5f * by_x * in_last * in_last;
    sums[last] += here - before;
    sums[last + 1] += height - here;
  }

  int width_;
  std::vector<float> sums_;            ///< changes of the share from column to column, row by row
  std::vector<float> shares_;          ///< shares of the row that is visited
  std::array<Span, kBandRows> spans_;  ///< columns of each row that are touched
};

}  // namespace afterglow::render
