/// \file
/// Conversions from Eigen, in which scenes and lenses are, to GLM, in which this room and its
/// shaders are.
#pragma once

#include <Eigen/Core>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace afterglow::render {

inline glm::dvec2 toGlm(const Eigen::Vector2d& v) { return {v.x(), v.y()}; }
inline glm::dvec3 toGlm(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// M(row, column) is [column][row].
template <int kSize>
glm::mat<kSize, kSize, double> toGlm(const Eigen::Matrix<double, kSize, kSize>& M) {
  glm::mat<kSize, kSize, double> result;
  for (int column = 0; column < kSize; ++column) {
    for (int row = 0; row < kSize; ++row) result[column][row] = M(row, column);
  }
  return result;
}

}  // namespace afterglow::render
