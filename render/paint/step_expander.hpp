/// \file
/// Steps of a composed image as the CPU paints them: small solids, letters and lists of small
/// things as outlines, the rest as triangles.
#pragma once

#include <cstddef>
#include <vector>

#include "render/compose/triangle_projector.hpp"
#include "render/compose/workers.hpp"
#include "render/paint/outline_projector.hpp"
#include "render/paint/sprites.hpp"

namespace afterglow::render {

/// Counts of each part of ExpandedSteps; the result of a step lies between two of them.
struct StepEnds {
  std::size_t vertices = 0, indices = 0, sprites = 0, corners = 0, pieces = 0;

  void operator+=(const StepEnds& other);
};

/// The results of steps, in their order. A piece is a part of `triangles.indices` or `sprites`.
struct ExpandedSteps {
  LightTriangles triangles;
  Sprites sprites;
  std::vector<Piece> pieces;

  void clear();
  StepEnds ends() const;
  /// Appends the part of another one that lies between two ends.
  void append(const ExpandedSteps& other, const StepEnds& from, const StepEnds& to);
};

/// Keeps its buffers from step to step. Used from one thread at a time, and of several expanders
/// each in a thread of its own.
class StepExpander {
 public:
  explicit StepExpander(const calib::Lens& lens)
      : triangle_projector_(lens),
        sprite_projector_(lens),
        letter_projector_(lens, triangle_projector_.domain()),
        outline_projector_(lens) {}

  /// Appends the pieces of a drawable, which is no pixelCloud(). Lists of very many things are
  /// shared by the workers.
  void expand(const Drawable& drawable, const ComposedLayer& layer, Workers& workers,
              ExpandedSteps& out);

 private:
  /// Adds the drawable if it is a list of things small enough; returns whether it did.
  bool addSprites(const Drawable& drawable, const ComposedLayer& layer, Workers& workers,
                  ExpandedSteps& out) const;
  /// Adds the drawable if it is letters of which all is seen; returns whether it did.
  bool addLetters(const Drawable& drawable, const ComposedLayer& layer, ExpandedSteps& out);
  /// Adds the outlines of the placed triangles if they are small and convex; returns whether it
  /// did.
  bool addHulls(const ComposedLayer& layer, ExpandedSteps& out);

  TriangleProjector triangle_projector_;
  SpriteProjector sprite_projector_;
  LetterProjector letter_projector_;
  OutlineProjector outline_projector_;
  std::vector<OutlinePoint> outline_points_;
};

}  // namespace afterglow::render
