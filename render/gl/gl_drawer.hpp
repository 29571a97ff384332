/// \file
/// Composed images drawn by OpenGL, four samples a pixel.
#pragma once

#include <memory>

#include "calib/lens.hpp"
#include "render/compose/image_drawer.hpp"
#include "render/gl/gl_context.hpp"

namespace afterglow::render {

/// Throws std::runtime_error where OpenGL cannot be used, and why.
std::unique_ptr<ImageDrawer> makeGlDrawer(GlContext& context, const calib::Lens& lens);

}  // namespace afterglow::render
