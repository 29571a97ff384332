/// \file
/// The choice of one of the projectors of a configuration.
#pragma once

#include <string>

#include "nodes/projector/projector_config.hpp"

namespace afterglow::nodes {

/// The configuration with one projector alone: the one of that name, or the only one. Throws
/// std::runtime_error, with the names that there are.
ProjectorConfig ofProjector(ProjectorConfig config, const std::string& name);

}  // namespace afterglow::nodes
