/// \file
/// The exact share of every pixel that an outline covers.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "render/paint/band_bins.hpp"

namespace afterglow::render {

/// A corner on the image; pixel i spans [i, i + 1).
struct Corner {
  float x, y;
};

/// Sums what each edge covers to its right, as font rasterizers do ("signed area coverage"): two
/// triangles that share an edge share its pixels without gap or overlap. Float arithmetic: shares
/// are right to about 1e-5. Keeps its buffer.
class PolygonCoverage {
 public:
  explicit PolygonCoverage(int width)
      : width_(width),
        sums_((static_cast<std::size_t>(width) + 2) * kBandRows),
        shares_(static_cast<std::size_t>(width)) {}

  /// How corners make an outline.
  enum class Outline {
    Polygon,  ///< each corner is joined to the next, and the last to the first
    Edges,    ///< any: every two corners are an edge, all turning the same way around the inside
  };

  /// px; corners farther out, or not a number, are not drawn: no integer could hold them.
  static constexpr float kFarthest = 1e7f;

  /// Calls visit(row, column, count, const float* shares) for each row in [row_begin, row_end),
  /// which are at most kBandRows, that is touched. Shares are positive if the outline turns
  /// clockwise as seen (y down), else negative.
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
      visit(row, span.begin, count, static_cast<const float*>(shares_.data()));
    }
  }

 private:
  struct Span {
    int begin, end;
  };

  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  float* sumsOf(int row) { return sums_.data() + at(row) * (at(width_) + 2); }

  void addEdge(const Corner& a, const Corner& b, int first, int last) {
    const bool is_up = b.y < a.y;
    const Corner& high = is_up ? b : a;
    const Corner& low = is_up ? a : b;
    if (low.y <= static_cast<float>(first) || high.y > static_cast<float>(last + 1)) return;
    if (!(low.y > high.y)) return;
    const float slope = (low.x - high.x) / (low.y - high.y), sign = is_up ? 1.f : -1.f;
    const int begin = std::max(first, static_cast<int>(std::max(high.y, 0.f)));
    const int end = std::min(last, static_cast<int>(low.y));
    for (int row = begin; row <= end; ++row) {
      const float top = std::max(high.y, static_cast<float>(row));
      const float bottom = std::min(low.y, static_cast<float>(row + 1));
      if (!(bottom > top)) continue;
      const float from = high.x + (top - high.y) * slope;
      const float to = high.x + (bottom - high.y) * slope;
      addInside(std::min(from, to), std::max(from, to), (bottom - top) * sign,
                spans_[at(row - first)], sumsOf(row - first));
    }
  }

  /// Parts beyond the image's sides count there as far as they matter to the image.
  void addInside(float left, float right, float height, Span& span, float* sums) const {
    const auto width = static_cast<float>(width_);
    if (left >= width) {
      span.end = width_;
      return;
    }
    if (right > width) {
      const float inside = (width - left) / (right - left);
      span.end = width_;
      height *= inside;
      right = width;
    }
    if (left < 0) {
      const float outside = right <= 0 ? 1 : -left / (right - left);
      span.begin = 0;
      span.end = std::max(span.end, 1);
      sums[0] += height * outside;
      if (right <= 0) return;
      height *= 1 - outside;
      left = 0;
    }
    addSpan(left, right, height, span, sums);
  }

  void addSpan(float left, float right, float height, Span& span, float* sums) const {
    const int first = static_cast<int>(left), last = static_cast<int>(right);
    span.begin = std::min(span.begin, first);
    span.end = std::max(span.end, std::min(last + 1, width_));
    if (first == last) {
      const float outside = 0.5f * (left + right) - static_cast<float>(first);
      sums[first] += height * (1 - outside);
      sums[first + 1] += height * outside;
      return;
    }
    // Covered of a column: the mean height of the edge over it, from `left` on.
    const float by_x = height / (right - left);
    const float in_first = static_cast<float>(first + 1) - left;
    float before = 0.5f * by_x * in_first * in_first;
    sums[first] += before;
    for (int i = first + 1; i < last; ++i) {
      const float here = by_x * (static_cast<float>(i) + 0.5f - left);
      sums[i] += here - before;
      before = here;
    }
    const float in_last = right - static_cast<float>(last);
    const float here = height - 0.5f * by_x * in_last * in_last;
    sums[last] += here - before;
    sums[last + 1] += height - here;
  }

  int width_;
  std::vector<float> sums_;            ///< changes of the share from column to column, row by row
  std::vector<float> shares_;          ///< of the row that is visited
  std::array<Span, kBandRows> spans_;  ///< columns of each row that are touched
};

}  // namespace afterglow::render
