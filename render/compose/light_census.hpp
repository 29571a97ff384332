/// \file
/// The part of a scene that a projector's light reaches, and what keeps it from the rest: for
/// people who ask why the floor is dark. Beside the drawing, once in a while, not for every image.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "render/compose/light_composer.hpp"
#include "render/compose/triangle_projector.hpp"

namespace afterglow::render {

/// The drawables of a layer, each counted once.
struct LayerCensus {
  std::string name;           ///< the layer's
  std::size_t drawables = 0;  ///< all of them: the sum of what follows
  std::size_t lit = 0;        ///< the drawables that are lit, at least in part
  std::size_t outside = 0;    ///< beside the light, or too close to the lens
  std::size_t behind = 0;     ///< behind the lens
  std::size_t clipped = 0;    ///< beside the surface's outline, or where others shade it
  std::size_t black = 0;        ///< no light that a picture's steps of 1/255 can show
  std::size_t transparent = 0;  ///< no alpha
  std::size_t flat = 0;         ///< seen edge-on or from so far that no pixel shows it
  std::size_t blank = 0;        ///< text without a letter that can be seen
  std::size_t empty = 0;        ///< no points
  /// Lists of more large things than are drawn (kMostCorners), whatever else is said of them.
  std::size_t thinned = 0;
};

/// Costs about as much as one image's geometry; of a large cloud it looks at some points only.
/// Keeps its buffers. One thread at a time.
class LightCensus {
 public:
  explicit LightCensus(const calib::Lens& lens)
      : domain_(lens), composer_(lens), triangles_(lens) {}

  /// Counts by layer. Throws std::logic_error as placementMatrix does.
  std::vector<LayerCensus> count(const Scene& scene,
                                 const Rigid<Projector, World>& T_projector_world);

 private:
  /// The count of a census to which a drawable belongs.
  using Fate = std::size_t LayerCensus::*;

  /// A cloud or list, things alike.
  struct Things;

  Fate fateOf(const Drawable& drawable, const ComposedLayer& layer, const ComposedImage& image);
  Fate fateOfThings(const Things& things, const Drawable& drawable, const ComposedLayer& layer,
                    const ComposedImage& image);
  Fate fateOfPiece(const Piece& piece, const ComposedMask* mask) const;

  LensDomain domain_;
  LightComposer composer_;
  TriangleProjector triangles_;
  LightTriangles seen_;
  bool is_thinned_ = false;  ///< the last drawable
};

}  // namespace afterglow::render
