/// \file
/// Letters as one outline on the image, instead of the triangles within it.
#pragma once

#include <optional>
#include <vector>

#include "render/compose/composed_image.hpp"
#include "render/paint/float_lens.hpp"
#include "render/paint/sprites.hpp"
#include "render/scene/lens_domain.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

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
};

}  // namespace afterglow::render
