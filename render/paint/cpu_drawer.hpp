/// \file
/// Composed images drawn by the CPU: every edge with the exact share of each pixel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "render/compose/composed_image.hpp"
#include "render/paint/image_painter.hpp"
#include "render/paint/point_projector.hpp"
#include "render/paint/step_expander.hpp"

namespace afterglow::render {

/// Expands each step for an ImagePainter: pixel-sized clouds become points, many small things alike
/// and small solids one outline each, the rest triangles. What a step has become is kept for the
/// next image, which expands again what is new only, and paints the bands alone that differ, where
/// those are few. Keeps its buffers from image to image. Used from one thread at a time, with
/// threads of its own.
class CpuDrawer final : public ImageDrawer {
 public:
  /// The image is the same whatever the number of threads.
  explicit CpuDrawer(const calib::Lens& lens, int threads = Workers::usualCount());

  void begin(const ComposedImage& composed) override;
  void finish(Image& image) override;

 private:
  /// A step, and what it has become.
  struct Step {
    Drawable drawable;
    StepEnds from, to;
    bool is_new = true;  ///< otherwise as in the image before
  };
  struct ExpandedImage {
    bool is_finished = false;  ///< otherwise it may lack some of it
    PaintList list;
    std::vector<ComposedMask> masks;
    std::vector<ComposedLayer> layers;     ///< the layers without their steps
    std::vector<std::vector<Step>> steps;  ///< the steps by layer
  };

  void addLayer(const ComposedLayer& layer, std::vector<Step>& steps);
  void addPoints(const Drawable& drawable, const ComposedLayer& layer);
  /// Steps of which none is worth to be shared: each worker takes some of them.
  void addAmongWorkers(const ComposedLayer& layer, std::size_t begin, std::size_t end,
                       std::vector<Step>& steps);
  void addStep(StepExpander& expander, const ComposedLayer& layer, std::size_t index, Step& step,
               ExpandedSteps& out);
  /// The same layer's steps in the image before; absent if its light lies elsewhere.
  const std::vector<Step>* stepsBefore(const ComposedLayer& layer, std::size_t index) const;
  void findDamage();

  Workers workers_;
  PointProjector point_projector_;
  std::deque<StepExpander> expanders_;  ///< an expander for each worker
  ImagePainter painter_;
  ExpandedImage now_, before_;
  const std::vector<Step>* steps_before_ = nullptr;  ///< the steps of the layer that is added
  std::size_t screen_point_count_ = 0;
  std::vector<ExpandedSteps> parts_;  ///< the parts that the workers expand, in the steps' order
  ImagePainter::Bands damage_;        ///< bands that differ from the image before
  std::vector<std::uint8_t> kept_;    ///< the last image; empty: not kept, as much of it differed
};

}  // namespace afterglow::render
