/// \file
/// Surfaces as seen by light on its way to another one.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "render/scene/scene.hpp"

namespace afterglow::render {

/// Height over the surface's plane as a row: height = row . (p_world, 1).
Eigen::Vector4d heightRow(const SurfacePatch& surface);

/// The corners of its polygon, in world coordinates; empty: the surface is endless.
std::vector<Eigen::Vector3d> outlineInWorld(const SurfacePatch& surface);

/// Whether they catch light at the same places of their planes.
bool isSame(const SurfacePatch& a, const SurfacePatch& b);

/// The part of an outline that lies on the lens's side of the surface's plane: light through it
/// never reaches the surface. World coordinates.
std::vector<Eigen::Vector3d> partBefore(const SurfacePatch& surface,
                                        const std::vector<Eigen::Vector3d>& outline,
                                        const Eigen::Vector3d& p_lens);

}  // namespace afterglow::render
