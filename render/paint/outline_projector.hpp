/// \file
/// Small solids and letters as one outline on the image each, instead of many triangles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "render/compose/composed_image.hpp"
#include "render/paint/float_lens.hpp"
#include "render/paint/sprites.hpp"
#include "render/scene/lens_domain.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// A point in normalized coordinates; depth as LightVertex::depth.
struct OutlinePoint {
  float x, y, depth;
};

/// All points lie in front of the lens. Keeps its buffers between calls.
class OutlineProjector {
 public:
  explicit OutlineProjector(const calib::Lens& lens) : lens_(lens) {}

  /// Appends the convex hull of points, as deep as their mean.
  Piece projectHull(const OutlinePoint* points, std::size_t count, std::uint32_t color,
                    Sprites& out);

 private:
  FloatLens lens_;
  std::vector<Corner> corners_, outline_;
};

/// Keeps its buffers between calls.
class LetterProjector {
 public:
  /// The domain is that of the lens, and outlives this.
  LetterProjector(const calib::Lens& lens, const LensDomain& domain)
      : lens_(lens), domain_(domain) {}

  /// Appends the outline of a text's letters to `out` as one of its sprites, or nothing if they
  /// have no color. Absent, and nothing appended, if they have no outline, or the lens does not
  /// show all of the rectangle around them, or bends one of their edges.
  std::optional<Piece> project(const Body& letters, const Drawable& drawable,
                               const ComposedLayer& layer, Sprites& out);

 private:
  /// Projective, from the letters' plane to the optical frame.
  using PlaneMatrix = Eigen::Matrix<double, 4, 3>;

  bool areEdgesStraight(const Body& letters, const PlaneMatrix& P_optical_letters) const;
  template <bool kFisheye>
  void projectPoints(const Body& letters, const PlaneMatrix& P_optical_letters);

  FloatLens lens_;
  const LensDomain& domain_;
  std::vector<Corner> seen_;  ///< the letters' points
  std::vector<Corner> outline_;
};

}  // namespace afterglow::render
