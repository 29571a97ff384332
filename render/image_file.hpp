/// \file
/// Images as PNG files.
#pragma once

#include <string>

#include "render/scene/image.hpp"

namespace afterglow::render {

/// Throws std::runtime_error naming the path if it cannot be written.
void writePng(const std::string& path, const Image& image);

}  // namespace afterglow::render
