/// \file
/// Edges of a drawn image without stairs.
#pragma once

#include "render/scene/image.hpp"

namespace afterglow::render {

/// Mixes along the edge where brightness jumps between neighbors, as far as the jump is strong.
/// This stands in place of multisampling, which costs a CPU four times the shading; and on the CPU,
/// because most of an image has no edge, which OpenGL in software would not be spared. The idea is
/// FXAA's (Lottes, NVIDIA 2009).
void smoothEdges(Image& image);

}  // namespace afterglow::render
