/// \file
/// The room that a projector lights, as a bystander sees it.
#pragma once

#include <memory>
#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "render/gl/gl_context.hpp"
#include "render/scene/image.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// Paint of this color is wood: its grain is drawn.
constexpr Color kWoodPaint{0.79f, 0.69f, 0.54f, 1};

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

/// The room as a bystander sees it: solid things (color is their paint), a lamp and a soft sky with
/// their shadows, and the projector's light with occlusion, lens and falloff, exposed as a camera
/// would, hues kept, and faintly in the air. What is translucent (alpha below 1) is gone: a gray
/// solid at a quarter of its opacity, which takes no light. PointStyle::Points, which has no size
/// in a room, is left out.
class ObserverRenderer {
 public:
  /// Throws std::runtime_error where OpenGL cannot be used, and why.
  explicit ObserverRenderer(GlContext& context);
  ~ObserverRenderer();
  /// Renders the room; without `light` (nullptr) the projector is off. Throws std::logic_error for
  /// a view without size or angle and for an image whose size is not its lens's.
  Image render(const std::vector<Drawable>& solids, const ProjectedLight* light,
               const ObserverView& view);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace afterglow::render
