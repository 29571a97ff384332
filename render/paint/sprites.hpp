/// \file
/// Small squares, boxes and balls by the thousand, small solids and letters: each becomes one
/// outline on the image, its corners put through the exact lens, instead of dozens of triangles.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "calib/lens.hpp"
#include "render/paint/float_lens.hpp"
#include "render/paint/point_projector.hpp"
#include "render/paint/polygon_coverage.hpp"
#include "render/paint/workers.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// What stands at every point of a list. All in the list's own frame.
struct SpriteShape {
  enum class Kind { Square, Box, Ball } kind;
  /// Half sizes along x, y and z; a square's along its own two axes.
  Eigen::Vector3f half = Eigen::Vector3f::Ones();
  Eigen::Vector3f right = Eigen::Vector3f::UnitX(), up = Eigen::Vector3f::UnitY();  ///< a square's
  Eigen::Vector3f eye = Eigen::Vector3f::UnitZ();  ///< whose outline is wanted
  bool eye_is_direction = false;                   ///< towards the eye
};

/// One on the image.
struct Sprite {
  std::uint32_t first = 0, count = 0;  ///< of the corners
  std::uint32_t color = 0;
  float slack = 0;
  float depth = 0;           ///< at window coordinates (0, 0), and how it changes
  float by_x = 0, by_y = 0;  ///< a list's: 0, as deep as its centre all over
  PolygonCoverage::Outline outline = PolygonCoverage::Outline::Polygon;
};

struct SpriteRun {
  std::uint32_t first = 0, count = 0;  ///< of the sprites
  bool is_opaque = true;
  double mean_depth = 0;
};

struct Sprites {
  std::vector<Sprite> all;      ///< `used` of them, and room
  std::vector<Corner> corners;  ///< `used_corners` of them, and room
  std::size_t used = 0, used_corners = 0;

  void clear() { used = used_corners = 0; }
};

/// In normalized coordinates; depth as LightVertex::depth.
struct OutlinePoint {
  float x, y, depth;
};

/// Sprites are at most this large (px): the edges of a larger square may bend in a lens, and a
/// larger body's depth is not that of its centre.
constexpr float kLargestSquare = 64, kLargestBody = 24;

/// Keeps its buffers between calls.
class SpriteProjector {
 public:
  explicit SpriteProjector(const calib::Lens& lens)
      : lens_(lens), width_(lens.width), height_(lens.height) {}

  /// Appends what reaches the image; what touches the fold of the lens or its near plane is left
  /// out. Absent, and nothing appended, if one is larger than that.
  std::optional<SpriteRun> project(const PointList& points, const ColorList& colors,
                                   const Color& color, const SpriteShape& shape,
                                   const PointPlacement& placement, Workers& workers,
                                   Sprites& out) const;

  /// Appends the outline of something flat that is of one color: `edges` are pairs of `points`,
  /// which all lie in front of the lens.
  SpriteRun projectOutline(const std::vector<OutlinePoint>& points,
                           const std::vector<std::array<std::uint32_t, 2>>& edges,
                           std::uint32_t color, Sprites& out);

  /// Appends the convex hull of points in front of the lens, as deep as their mean.
  SpriteRun projectHull(const OutlinePoint* points, std::size_t count, std::uint32_t color,
                        Sprites& out);

 private:
  Corner seen(const OutlinePoint& point) const;

  FloatLens lens_;
  int width_, height_;
  std::vector<Corner> corners_, outline_;
};

}  // namespace afterglow::render
