/// \file
/// How a layer looks: the keys style, size, color and decay, and those of paths.
#pragma once

#include "nodes/projector/layer_config.hpp"

namespace afterglow::nodes {

/// For a layer whose type is known. Throws std::runtime_error "FILE:LINE: what is wrong", also for
/// a key that would do nothing.
void readLook(const YamlMap& map, LayerConfig& layer);

}  // namespace afterglow::nodes
