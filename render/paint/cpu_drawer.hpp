/// \file
/// Composed images drawn by the CPU: every edge with the exact share of each pixel.
#pragma once

#include <optional>
#include <vector>

#include "render/compose/composed_image.hpp"
#include "render/paint/image_painter.hpp"
#include "render/paint/outline_projector.hpp"

namespace afterglow::render {

/// Expands each step for an ImagePainter: pixel-sized clouds become points, many small things alike
/// and small solids one outline each, the rest triangles. Keeps its buffers from image to image.
/// Used from one thread at a time, with threads of its own.
class CpuDrawer final : public ImageDrawer {
 public:
  /// The image is the same whatever the number of threads.
  explicit CpuDrawer(const calib::Lens& lens, int threads = Workers::usualCount());

  void draw(const ComposedImage& composed, Image& image) override;

 private:
  void expand(const Drawable& drawable, const ComposedLayer& layer);
  void addPoints(const Drawable& drawable, const ComposedLayer& layer);
  /// Whether the drawable is a list of things small enough; then it is added.
  bool addSprites(const Drawable& drawable, const ComposedLayer& layer);
  /// Whether the placed triangles are something flat of one color, or small and convex; then their
  /// outlines are added.
  bool addOutlines(const ComposedLayer& layer);
  bool isFlat() const;
  Piece hulls();

  Workers workers_;
  PointProjector point_projector_;
  SpriteProjector sprite_projector_;
  OutlineProjector outline_projector_;
  TriangleProjector triangle_projector_;
  ImagePainter painter_;
  PaintList list_;
  std::size_t screen_point_count_ = 0;
  std::vector<Piece>* pieces_ = nullptr;  ///< of the layer that is expanded
  std::vector<OutlinePoint> outline_points_;
};

}  // namespace afterglow::render
