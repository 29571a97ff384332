/// \file
/// Facts about a body that spare drawing parts of it.
#pragma once

#include "render/scene/scene.hpp"

namespace afterglow::render {

/// Sets Body::is_closed where every edge joins two triangles that turn alike, and they face
/// outwards (counterclockwise as seen from there). Corners at the same place are one.
void findWhetherClosed(Body& body);

/// The edges that one triangle has alone. Sets Body::outline; for a flat body whose triangles do
/// not overlap and turn all the same way.
void findOutline(Body& body);

}  // namespace afterglow::render
