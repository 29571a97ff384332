/// \file
/// Small squares, boxes and balls by the thousand: each becomes one outline on the image, its
/// corners put through the exact lens, instead of dozens of triangles.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "calib/lens.hpp"
#include "render/compose/composed_image.hpp"
#include "render/compose/workers.hpp"
#include "render/paint/float_lens.hpp"
#include "render/paint/point_projector.hpp"
#include "render/paint/polygon_coverage.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// A sprite on the image.
struct Sprite {
  std::uint32_t first = 0, count = 0;  ///< range of the corners
  std::uint32_t color = 0;
  float slack = 0;
  float depth = 0;           ///< depth at window coordinates (0, 0), and its slopes
  float by_x = 0, by_y = 0;  ///< a list's: 0, as deep as its center all over
  float top = 0, bottom = 0;  ///< of its corners
  PolygonCoverage::Outline outline = PolygonCoverage::Outline::Polygon;
};

struct Sprites {
  std::vector<Sprite> all;      ///< `used` of them, and room
  std::vector<Corner> corners;  ///< `used_corners` of them, each outline closed, and room
  std::size_t used = 0, used_corners = 0;

  void clear() { used = used_corners = 0; }
  /// Makes room for so many more.
  void makeRoom(std::size_t more, std::size_t more_corners);
  /// Appends one, and sets what follows from its corners.
  void add(Sprite sprite, const std::vector<Corner>& outline);
  /// Appends a part of another's, and the corners that it has.
  void append(const Sprites& other, std::size_t begin, std::size_t end, std::size_t corners_begin,
              std::size_t corners_end);
};

/// Sprites are at most this large (px): the edges of a larger square may bend in a lens, and a
/// larger body's depth is not that of its center.
constexpr float kLargestSquare = 64, kLargestBody = 24;

class SpriteProjector {
 public:
  explicit SpriteProjector(const calib::Lens& lens)
      : lens_(lens), width_(lens.width), height_(lens.height) {}

  /// Appends the things of the list that reach the image, without those that touch the fold of the
  /// lens or its near plane. Absent, and nothing appended, if one of them is larger than that.
  std::optional<Piece> project(const SpriteList& list, const Color& color,
                               const PointPlacement& placement, Workers& workers,
                               Sprites& out) const;

 private:
  FloatLens lens_;
  int width_, height_;
};

}  // namespace afterglow::render
