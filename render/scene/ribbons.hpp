/// \file
/// Lines as ribbons of world width that face an eye (RViz's billboard lines), with round joins.
#pragma once

#include <vector>

#include "render/scene/mesh.hpp"
#include "render/scene/tessellate.hpp"

namespace afterglow::render {

struct RibbonPoint {
  Eigen::Vector3d p_world;
  Rgba color;
};

/// Consecutive points joined. A point that is not finite interrupts the strip.
void addStrip(const std::vector<RibbonPoint>& points, double width, const Eye& eye, Mesh& mesh);

/// Pairs of points joined; a last one without its pair is left out.
void addSegments(const std::vector<RibbonPoint>& points, double width, const Eye& eye, Mesh& mesh);

}  // namespace afterglow::render
