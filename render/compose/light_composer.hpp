/// \file
/// A scene into the steps of drawing it for a projector: what is drawn, in which order, placed how.
#pragma once

#include <deque>
#include <vector>

#include "render/compose/composed_image.hpp"
#include "render/scene/cut.hpp"

namespace afterglow::render {

/// Keeps its buffers from image to image.
class LightComposer {
 public:
  explicit LightComposer(const calib::Lens& lens);
  LightComposer(const LightComposer&) = delete;
  LightComposer& operator=(const LightComposer&) = delete;

  /// Points into the scene; valid as long as that, until the next call. Throws std::logic_error as
  /// placementMatrix does.
  const ComposedImage& compose(const Scene& scene,
                               const Rigid<Projector, World>& T_projector_world);

 private:
  void addLayer(const Layer& layer);
  /// Returns the placer of a layer that lies on a relief: one of the images before if it fits.
  std::shared_ptr<const ReliefPlacer> placerFor(const Layer& layer);
  const Drawable& laid(const Drawable& drawable, const ReliefPlacer& relief);
  /// The surface's mask, made once an image; -1: it needs none.
  int maskOf(const SurfacePatch& surface);
  SeenOutline seenOutline(const std::vector<Eigen::Vector3d>& corners_world);

  LensDomain domain_;
  TriangleCutter cutter_;
  std::vector<CutVertex> corners_;
  ComposedImage image_;

  const Scene* scene_ = nullptr;  ///< being composed
  Rigid<Projector, World> T_projector_world_;
  std::vector<const SurfacePatch*> masked_;                   ///< the surfaces of the image's masks
  std::vector<std::shared_ptr<const ReliefPlacer>> placers_;  ///< of layers on reliefs
  std::deque<Drawable> laid_;                                 ///< clouds on reliefs
};

}  // namespace afterglow::render
