/// \file
/// Comparison of two scenes, or of two drawables.
#pragma once

#include "render/scene/scene.hpp"

namespace afterglow::render {

/// Compares by value, bit by bit; lists, bodies and reliefs that both share are not looked into.
/// False is always allowed: equal bodies that are not shared are taken for different. The first
/// difference mostly decides.
bool isSame(const Scene& a, const Scene& b);
bool isSame(const Drawable& a, const Drawable& b);

}  // namespace afterglow::render
