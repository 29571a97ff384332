/// \file
/// Triangles as bytes for a pipe between two programs of one build on one machine; not for files.
#pragma once

#include <string>

#include "render/scene/scene.hpp"

namespace afterglow::render {

std::string toBytes(const Body& body);

/// Throws std::runtime_error unless the bytes are, to the last, a body whose points and colors are
/// finite and whose triangles name points: whoever wrote them may have lost its mind on the way.
Body bodyFromBytes(const std::string& bytes);

}  // namespace afterglow::render
