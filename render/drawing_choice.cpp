#include "render/drawing_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/scene/tessellate.hpp"

namespace afterglow::render {

double DrawingPace::msOf(std::size_t points) const {
  constexpr double kSpan = static_cast<double>(kMany) - static_cast<double>(kFew);
  const double share = (static_cast<double>(points) - static_cast<double>(kFew)) / kSpan;
  return std::max(few_ms + share * (many_ms - few_ms), 0.0);
}

bool DrawingChoice::isForGl(std::size_t points, bool was_gl) const {
  constexpr double kClear = 0.8;  // of the other's time
  const double cpu_ms = cpu.msOf(points), gl_ms = gl.msOf(points);
  return was_gl ? !(cpu_ms < kClear * gl_ms) : gl_ms < kClear * cpu_ms;
}

std::string DrawingChoice::text() const {
  const bool few = gl.few_ms < cpu.few_ms, many = gl.many_ms < cpu.many_ms;
  const std::string who = few == many ? few ? "OpenGL" : "the CPU"
                          : many      ? "OpenGL where there is much to draw, else by the CPU"
                                      : "the CPU where there is much to draw, else by OpenGL";
  return fmt::format(
      "drawn by {} ({} points: {:.1f} ms by the CPU, {:.1f} ms by OpenGL; {}: {:.1f} and {:.1f})",
      who, DrawingPace::kFew, cpu.few_ms, gl.few_ms, DrawingPace::kMany, cpu.many_ms, gl.many_ms);
}

std::size_t pointsOf(const Scene& scene) {
  std::size_t points = 0;
  for (const Layer& layer : scene.layers) {
    for (const Drawable& drawable : layer.drawables) points += cornersOf(drawable.shape);
  }
  return points;
}

}  // namespace afterglow::render
