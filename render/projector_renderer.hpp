/// \file
/// Drawing a scene through a projector's lens.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "render/gl/gl_context.hpp"
#include "render/scene/image.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// The time that a back end takes: measured for images of so few points and of so many, a line
/// through both for what lies between and beyond.
struct DrawingPace {
  static constexpr int kFewColumns = 160, kManyColumns = 640;  ///< three quarters as many rows
  static constexpr std::size_t kFew = 160 * 120, kMany = 640 * 480;

  double few_ms = 0, many_ms = 0;

  double msOf(std::size_t points) const;
};

struct DrawingChoice {
  DrawingPace cpu, gl;

  /// Returns true if OpenGL draws an image of so many points and corners. The one that drew the
  /// last image stays where both are about as fast.
  bool isForGl(std::size_t points, bool was_gl) const;
  /// Describes the choice for people.
  std::string text() const;
};

/// Counts the points and corners in a scene.
std::size_t pointsOf(const Scene& scene);

/// The back end that draws. The image is the same but for edges: the CPU gives each pixel the
/// exact share that is covered (CpuDrawer), OpenGL takes four samples.
enum class Drawing {
  Measured,  ///< the faster one here for each image, by measured times of images in the making
  Gl,
  Cpu,  ///< no OpenGL is needed
};

/// The image that a projector has to show so that the scene's light lands where the scene says.
/// Geometry is exact at vertices (placement, off-axis frustum from K with any principal point,
/// distortion); edges are subdivided until the lens bends them by less than 0.1 px. Black where
/// nothing is drawn. Content that the lens model folds back is clipped.
///
/// Light, not ink: every shape has its full flat color, where RViz's headlight shades solids; a
/// shaded side would only be a darker projection. Alpha blends over black in sRGB values, as
/// RViz's; of a translucent thing each pixel takes the nearest surface only. Direct layers hide
/// each other by distance. A draped or viewer-placed one lies flat: it hides itself by height over
/// the surface, and lies over the layers before it.
class ProjectorRenderer {
 public:
  /// Throws std::runtime_error where OpenGL is wanted and cannot be used.
  ProjectorRenderer(GlContext& context, const calib::Lens& lens, Drawing drawing = Drawing::Cpu);
  ~ProjectorRenderer();
  /// Throws std::logic_error as placementMatrix does. The CPU draws on where the GPU was reset.
  Image render(const Scene& scene, const Rigid<Projector, World>& T_projector_world);
  /// The same into an image whose memory is used again. Scene and pose of the last time are not
  /// drawn again.
  void render(const Scene& scene, const Rigid<Projector, World>& T_projector_world, Image& image);
  /// The same in two steps, between which a GPU draws on: for other projectors' images to be begun.
  void begin(const Scene& scene, const Rigid<Projector, World>& T_projector_world);
  void finish(Image& image);
  /// The back end that draws, and why; for people.
  const std::string& description() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace afterglow::render
