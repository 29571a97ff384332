/// \file
/// Lines whose width is given in pixels: RViz's line style "Lines".
#pragma once

#include <vector>

#include "render/scene/cut.hpp"

namespace afterglow::render {

/// A line as a ribbon that the lens shows so many pixels wide all along, half a width longer at
/// both ends so that it meets its neighbors. Appends triangles, three vertices each, w = 1, which
/// may reach out of the domain.
void addThinLine(const LensDomain& domain, const CutVertex& from, const CutVertex& to,
                 double width_px, std::vector<CutVertex>& out);

}  // namespace afterglow::render
