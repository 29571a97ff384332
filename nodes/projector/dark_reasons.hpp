/// \file
/// The reasons why content is not lit: one list for /diagnostics, `afterglow watch`, the console
/// and `afterglow render`.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "nodes/projector/topic_monitor.hpp"
#include "render/compose/light_census.hpp"

namespace afterglow::nodes {

/// "2 of 4 drawables inside the light (2 beside it)"; `invisible`: drawables of alpha 0 that the
/// census does not know.
std::string lightWords(const render::LayerCensus& census, std::size_t invisible);

/// All that a layer does not light, a reason each, without its topic: the missing transform, what
/// the light does not reach, a newest message that shows nothing, what was dropped, and what is odd
/// about the rest. `light`: absent where it is unknown.
std::vector<std::string> darkReasons(const LayerStatus& layer,
                                     const std::optional<render::LayerCensus>& light);

/// The same of all layers, each behind its topic, after the `problems` that keep all dark. Nothing
/// is named twice.
std::vector<std::string> darkReasons(std::vector<std::string> problems,
                                     const std::vector<LayerStatus>& layers,
                                     const std::vector<render::LayerCensus>& light);

}  // namespace afterglow::nodes
