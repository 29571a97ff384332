/// \file
/// Outlines with holes into triangles that share the outlines' points and no others.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace afterglow::render {

using Outline = std::vector<Eigen::Vector2d>;  ///< closed; the last point is not the first again

/// Triangles over `outer` without `holes`, which lie inside it; either may run either way round.
/// Indices count through `outer`, then through the holes in order. Ear clipping: outlines that
/// cross themselves give some triangles, without an error. Pure; throws never.
std::vector<std::array<std::uint32_t, 3>> triangulate(const Outline& outer,
                                                      const std::vector<Outline>& holes);

}  // namespace afterglow::render
