/// \file
/// Triangles and sprites onto a band's canvas: every pixel gets the exact share that is covered.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "render/paint/canvas.hpp"
#include "render/paint/polygon_coverage.hpp"
#include "render/paint/sprites.hpp"

namespace afterglow::render {

/// A vertex as it is seen.
struct ScreenVertex {
  Corner at;
  float depth;          ///< see LightVertex::depth
  std::uint32_t color;  ///< r, g, b, a from the lowest byte on
};
using ScreenTriangle = std::array<ScreenVertex, 3>;
/// A fan of triangles of one color: corners of a polygon that all see the first.
using ScreenPolygon = std::vector<ScreenVertex>;

class PolygonBrush {
 public:
  explicit PolygonBrush(int width)
      : width_(width),
        coverage_(width),
        shares_(static_cast<std::size_t>(width)),
        depths_(shares_.size()) {}

  /// Paints the part of a triangle in a band whose first row is `row_begin`; both its sides are
  /// seen. `mask`: shares of kWhole, row by row, that light may cover; nullptr: all.
  void paint(const ScreenTriangle& triangle, int row_begin, int row_end, const std::uint16_t* mask,
             Canvas& canvas);

  /// Paints the polygon as deep as in the plane through three of its corners.
  void paint(const ScreenPolygon& polygon, int row_begin, int row_end, const std::uint16_t* mask,
             Canvas& canvas);
  /// Returns true if all its corners are in one plane, as far as depths tell.
  static bool isFlat(const ScreenPolygon& polygon);
  void paint(const Sprite& sprite, const Corner* corners, int row_begin, int row_end,
             const std::uint16_t* mask, Canvas& canvas);

  /// Adds the shares that are covered to `sums`, row by row; negative where it turns the other way.
  void add(const ScreenTriangle& triangle, int row_begin, int row_end, float* sums);

 private:
  using Outline = PolygonCoverage::Outline;

  /// Depth over the image, `slack` being how far it may change within a pixel.
  struct Depth {
    float origin = 0, by_x = 0, by_y = 0;  ///< depth at window coordinates (0, 0), and its slopes
    float slack = 0;
    float least = -1e9f, greatest = 1e9f;

    float ofRow(int row) const { return origin + by_y * (static_cast<float>(row) + 0.5f); }
    /// Returns the depth at a pixel's center.
    float at(float of_row, int column) const {
      const float here = of_row + by_x * (static_cast<float>(column) + 0.5f);
      return std::min(std::max(here, least), greatest);
    }
  };

  template <typename LightAt>
  void paintOutline(const Corner* corners, std::size_t count, Outline outline, int row_begin,
                    int row_end, const std::uint16_t* mask, Canvas& canvas, const LightAt& lightAt,
                    const Depth& depth);
  /// Whole numbers of kWhole for shares of 1, and the depths at the pixels' centers.
  void setRow(const float* shares, const std::uint16_t* allowed, int begin, int columns,
              float first_depth, const Depth& depth);

  int width_;
  PolygonCoverage coverage_;
  std::vector<std::uint32_t> shares_;  ///< shares of the part of a row that is painted
  std::vector<float> depths_;
  std::vector<Corner> corners_;
};

}  // namespace afterglow::render
