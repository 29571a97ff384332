/// \file
/// Outlines of what is gone.
#pragma once

#include <vector>

#include "render/scene/eye.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// The color's alpha is below 1: it is not there, only its outline is drawn.
bool isGhost(const Drawable& drawable);

/// Dashes along the edges of each ghost that bend by more than 40 degrees, end, or turn away from
/// the eye; as wide from afar as from near.
std::vector<Drawable> ghostOutlines(const std::vector<Drawable>& solids, const Eye& eye);

}  // namespace afterglow::render
