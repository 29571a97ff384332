/// \file
/// A scene as the triangles that a lens shows of it, before anybody draws them.
#pragma once

#include <vector>

#include "render/compose/light_composer.hpp"
#include "render/compose/triangle_projector.hpp"

namespace afterglow::test {

class SeenTriangles {
 public:
  SeenTriangles(const calib::Lens& lens, const render::Scene& scene) {
    render::LightComposer composer(lens);
    render::TriangleProjector projector(lens);
    const render::ComposedImage& composed = composer.compose(scene, {});
    triangles_.begin(composed);
    for (const render::ComposedLayer& layer : composed.layers) {
      for (const render::Drawable* drawable : layer.steps) {
        projector.place(*drawable, layer);
        if (const auto piece = projector.add(triangles_)) pieces_.push_back(*piece);
      }
    }
    sortForDrawing(pieces_);
  }

  const render::LightTriangles& triangles() const { return triangles_; }
  const std::vector<render::Piece>& pieces() const { return pieces_; }

 private:
  render::LightTriangles triangles_;
  std::vector<render::Piece> pieces_;
};

}  // namespace afterglow::test
