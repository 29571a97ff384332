/// \file
/// Whether a body is solid, so that what faces away from an eye need not be drawn.
#pragma once

#include "render/scene/scene.hpp"

namespace afterglow::render {

/// Every edge joins two triangles that turn alike, and they face outwards (counterclockwise as seen
/// from there). Corners at the same place are one. Sets Body::is_closed.
void findWhetherClosed(Body& body);

}  // namespace afterglow::render
