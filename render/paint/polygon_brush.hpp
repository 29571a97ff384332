/// \file
/// Triangles and sprites onto a band's canvas: every pixel gets the exact share that is covered.
#pragma once

#include <array>
#include <cstddef>
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
  /// Paints the same with eight lanes (withLanes) as with four.
  explicit PolygonBrush(int width, bool are_eight = hasAvx2())
      : width_(width),
        are_eight_(are_eight),
        coverage_(width),
        lights_(static_cast<std::size_t>(width) + kPixelsAtOnce) {}

  /// Paints the part of a triangle in a band whose first row is `row_begin`; both its sides are
  /// seen. `mask`: shares of kWhole, row by row, that light may cover, and room for kPixelsAtOnce
  /// more; nullptr: all.
  void paint(const ScreenTriangle& triangle, int row_begin, int row_end, const std::uint16_t* mask,
             Canvas& canvas);

  /// Paints the polygon as deep as in the plane through three of its corners.
  void paint(const ScreenPolygon& polygon, int row_begin, int row_end, const std::uint16_t* mask,
             Canvas& canvas);
  /// Returns true if all its corners are in one plane, as far as depths tell.
  static bool isFlat(const ScreenPolygon& polygon);
  /// `corners`: the sprite's, and kCornersMore.
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
  };
  /// The part of a band that light may cover.
  struct Band {
    int row_begin, row_end;
    const std::uint16_t* mask;
    Canvas& canvas;
  };

  /// setLights(row, begin, columns) sets `lights_`.
  template <typename SetLights>
  void paintOutline(const Corner* corners, std::size_t count, Outline outline, const Depth& depth,
                    const Band& band, const SetLights& setLights);
  void paintOutline(const Corner* corners, std::size_t count, Outline outline, const Depth& depth,
                    const Band& band, Light light);
  /// Paints a polygon a few pixels across; returns false if it is not, or reaches over the
  /// image's sides.
  template <int kPixels, int... kLanes>
  AFTERGLOW_INLINED bool paintSmall(const Corner* corners, std::size_t count, const Depth& depth,
                                    const Band& band, Light light,
                                    std::integer_sequence<int, kLanes...> lanes) const;
  void paintRow(const float* shares, int row, int begin, int columns, const Depth& depth,
                const Band& band) const;
  template <int kPixels, int... kLanes>
  AFTERGLOW_INLINED void paintPixels(const typename PixelVectors<kPixels>::Depths& shares, int row,
                                     int column, const Depth& depth, const Band& band,
                                     const typename PixelVectors<kPixels>::LightPair& lights,
                                     std::integer_sequence<int, kLanes...> lanes) const;

  int width_;
  bool are_eight_;
  PolygonCoverage coverage_;
  std::vector<Light> lights_;  ///< lights of the part of a row that is painted
  std::vector<Corner> corners_;
};

}  // namespace afterglow::render
