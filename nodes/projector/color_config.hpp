/// \file
/// The `color` of a layer.
#pragma once

#include <string>

#include "nodes/projector/layer_config.hpp"

namespace afterglow::nodes {

/// "#rrggbb" or [r, g, b] up to 255. Throws std::runtime_error "FILE:LINE: what is wrong".
render::Color readPlainColor(const YamlMap& map, const std::string& key);

/// A plain color; the name of a source of colors; or a map with `by`, that name, and how its
/// numbers become colors. Throws as readPlainColor.
void readColor(const YamlMap& map, LayerConfig& layer);

}  // namespace afterglow::nodes
