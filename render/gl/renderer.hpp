/// \file
/// Drawing a scene through a projector's lens, and the room a bystander sees it in. Works on any
/// OpenGL 4.5 core, Mesa's llvmpipe included.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// 8-bit sRGB, row by row from the top, no padding.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// An OpenGL context without window or screen (EGL: surfaceless, then device, then default
/// platform), made when it is first used: what needs none works where there is none. Everything
/// below is used in one thread alone and destroyed before it. makeCurrent() and description() throw
/// std::runtime_error naming the step that failed and what is missing.
class GlContext {
 public:
  GlContext();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;
  /// Whatever needs the context calls this; several can take turns in a thread.
  void makeCurrent();
  std::string description();  ///< e.g. "4.5 (Core Profile) Mesa 22.3.6, llvmpipe (...)"

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Who draws. The picture is the same but for edges: the CPU gives each pixel the exact share that
/// is covered (FramePainter), OpenGL takes four samples.
enum class Drawing {
  Measured,  ///< whoever is faster here: each draws a few frames in the renderer's making
  Gl,
  Cpu,  ///< no OpenGL is needed
};

/// What a projector has to show so that the scene's light lands where the scene says.
/// Geometry is exact at vertices (placement, off-axis frustum from K with any principal point,
/// distortion); edges are subdivided until the lens bends them by less than 0.1 px. Black where
/// nothing is drawn. Content that the lens model folds back is clipped.
///
/// Light, not ink: every shape has its full flat colour, where RViz's headlight shades solids; a
/// shaded side would only be a darker projection. Alpha blends over black in sRGB values, as
/// RViz's; of a translucent thing each pixel takes the nearest surface only. Direct layers hide
/// each other by distance. A draped or viewer-placed one lies flat: it hides itself by height over
/// the surface, and lies over the layers before it.
class ProjectorRenderer {
 public:
  ProjectorRenderer(GlContext& context, const calib::Lens& lens, Drawing drawing = Drawing::Cpu);
  ~ProjectorRenderer();
  /// Throws std::logic_error as placementMatrix does.
  Image render(const Scene& scene, const Rigid<Projector, World>& T_projector_world);
  /// The same into an image whose memory is used again.
  void render(const Scene& scene, const Rigid<Projector, World>& T_projector_world, Image& image);
  /// Who draws, and why; for people.
  const std::string& description() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A bystander's eye: pinhole, no distortion.
struct ObserverView {
  Rigid<World, Observer> T_world_observer;
  int width = 1280, height = 720;
  double vertical_fov = 0.9;  ///< radians
};

/// Light thrown into a room: one projector's image.
struct ProjectedLight {
  calib::Lens lens;
  Rigid<Projector, World> T_projector_world;
  Image image;
};

/// The room as a bystander sees it: solid things (every drawable opaque, colour its paint), soft
/// room light with contact shadows left out, and the projector's light with occlusion, lens and
/// falloff. PointStyle::Points, which has no size in a room, is left out.
class ObserverRenderer {
 public:
  explicit ObserverRenderer(GlContext& context);
  ~ObserverRenderer();
  /// Without `light` (nullptr) the projector is off. Throws std::logic_error for a view without
  /// size or angle and for an image whose size is not its lens's.
  Image render(const std::vector<Drawable>& solids, const ProjectedLight* light,
               const ObserverView& view);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace afterglow::render
