/// \file
/// An image through a projector's lens, before it is drawn: the steps of its drawing in order, each
/// a drawable and where its light goes. Each back end expands a step in its own way.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "render/scene/eye.hpp"
#include "render/scene/image.hpp"
#include "render/scene/relief_placer.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// Points reach this far (px) over the image's border before they are dropped.
constexpr float kPointMargin = 128;

/// The placement of a thing, from the world to the image.
struct Placed {
  /// Placement on a surface, then the projector's pose.
  Eigen::Matrix4d P_optical_world = Eigen::Matrix4d::Identity();
  /// Height over the surface = height . p_world
  Eigen::Vector4d height = Eigen::Vector4d::Zero();
  /// Flattened layers hide by height over the surface and lie over what was drawn before; the
  /// others hide each other by distance.
  bool flattened = false;
  float gain = 1;  ///< factor on sRGB components
};

/// Optical frame, meters; cut to the part that the lens shows, its edges straight on the image.
using SeenOutline = std::vector<Eigen::Vector3d>;
/// The region in which a surface catches light: inside of its outline by the even-odd rule, outside
/// of shades.
struct ComposedMask {
  std::optional<SeenOutline> outline;  ///< absent: the surface is endless
  std::vector<SeenOutline> shades;     ///< surfaces before it
};

struct ComposedLayer {
  Placed placed;
  Eye eye;  ///< flat things face it; its lens shows round things
  /// Lays meshes on the surface's relief, the same one as long as all lands at the same places;
  /// nullptr: the surface is flat.
  std::shared_ptr<const ReliefPlacer> relief;
  int mask = -1;  ///< index of the image's masks; -1: light may go anywhere
  /// The drawables, each a step. Clouds of PointStyle::Points are on the relief already.
  std::vector<const Drawable*> steps;
};

/// Layers in the order in which they are drawn.
struct ComposedImage {
  std::vector<ComposedMask> masks;
  std::vector<ComposedLayer> layers;
};

/// Returns true if the same step of both is the same light, on either side of masks.
bool isSamePlace(const ComposedLayer& a, const ComposedLayer& b);
bool isSame(const std::vector<ComposedMask>& a, const std::vector<ComposedMask>& b);

/// A step as the back end draws it.
struct Piece {
  enum class Kind {
    Triangles,  ///< triangles; each pixel takes the nearest of a translucent piece
    Outlines,   ///< the same
    Points,     ///< blended by how much of each pixel they cover, farthest first
  };
  Kind kind;
  bool is_opaque;              ///< points: never
  std::uint32_t first, count;  ///< range of the back end's list of that kind
  double mean_depth;           ///< see LightVertex::depth
};

struct ExpandedLayer {
  int mask = -1;           ///< see ComposedLayer
  bool flattened = false;  ///< see Placed
  std::vector<Piece> pieces;
};

/// Opaque pieces by their kinds, neighbors as one; then the others, farthest first.
void sortForDrawing(std::vector<Piece>& pieces);

/// Draws composed images: the CPU (paint/cpu_drawer.hpp) or OpenGL (gl/gl_context.hpp).
class ImageDrawer {
 public:
  virtual ~ImageDrawer() = default;
  /// Begins an image; a GPU goes on with it meanwhile. Nothing of `composed` is used afterwards.
  virtual void begin(const ComposedImage& composed) = 0;
  /// Finishes the image that was begun last: all pixels of `image`, which has the lens's size;
  /// black where there is no content.
  virtual void finish(Image& image) = 0;

  void draw(const ComposedImage& composed, Image& image) {
    begin(composed);
    finish(image);
  }
};

}  // namespace afterglow::render
