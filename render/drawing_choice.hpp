/// \file
/// The choice of the back end that draws an image sooner, by how much there is in it.
#pragma once

#include <cstddef>
#include <string>

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

}  // namespace afterglow::render
