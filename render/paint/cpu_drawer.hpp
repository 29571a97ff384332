/// \file
/// Composed images drawn by the CPU: every edge with the exact share of each pixel.
#pragma once

#include <deque>
#include <vector>

#include "render/compose/composed_image.hpp"
#include "render/paint/image_painter.hpp"
#include "render/paint/point_projector.hpp"
#include "render/paint/step_expander.hpp"

namespace afterglow::render {

/// Expands each step for an ImagePainter: pixel-sized clouds become points, many small things alike
/// and small solids one outline each, the rest triangles. Keeps its buffers from image to image.
/// Used from one thread at a time, with threads of its own.
class CpuDrawer final : public ImageDrawer {
 public:
  /// The image is the same whatever the number of threads.
  explicit CpuDrawer(const calib::Lens& lens, int threads = Workers::usualCount());

  void begin(const ComposedImage& composed) override;
  void finish(Image& image) override;

 private:
  using Steps = std::vector<const Drawable*>::const_iterator;

  void addSteps(const ComposedLayer& layer);
  void addPoints(const Drawable& drawable, const ComposedLayer& layer);
  /// Drawables of which none is worth to be shared: each worker takes some of them.
  void addAmongWorkers(Steps begin, Steps end, const ComposedLayer& layer);

  Workers workers_;
  PointProjector point_projector_;
  std::deque<StepExpander> expanders_;  ///< by worker
  ImagePainter painter_;
  PaintList list_;
  std::size_t screen_point_count_ = 0;
  std::vector<ExpandedSteps> parts_;  ///< of steps that the workers expand, in the steps' order
};

}  // namespace afterglow::render
