/// \file
/// The configuration of the projectors' world: which topics are shown where and how. One file for
/// projector_node and `afterglow render`; assets/projector.yaml explains every key.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "nodes/projector/avoid_config.hpp"
#include "nodes/projector/commanded_motion.hpp"
#include "nodes/projector/layer_config.hpp"
#include "nodes/projector/output_config.hpp"
#include "nodes/projector/surface_config.hpp"
#include "nodes/projector/watch_config.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

struct ProjectorConfig {
  std::string fixed_frame;
  std::vector<OutputConfig> projectors;  ///< projectors; at least one from a file
  std::optional<BlendConfig> blend;      ///< how their light is shared; empty: each has its own
  std::vector<SurfaceConfig> surfaces;
  std::vector<LayerConfig> layers;
  std::vector<std::string> mesh_roots;  ///< folders; empty: those of ROS packages (MeshLibrary)
  std::optional<WatchConfig> watch;     ///< projector_node's drift watch
  std::optional<AvoidConfig> avoid;     ///< what projector_node's light keeps off
  std::optional<BaseConfig> base;       ///< what carries projectors, and is commanded
};

/// `camera_info` is relative to `calibration_folder`, or, if that is empty, to the file's own
/// folder. Throws std::runtime_error "FILE:LINE: what is wrong" for a key that is unknown (with the
/// nearest known one), missing or given twice, and for a value of the wrong type or out of range.
ProjectorConfig loadProjectorConfig(const std::string& path, const std::string& calibration_folder);

/// The projector of this name, or the only one for an empty name. Throws std::runtime_error that
/// begins with the configuration's path.
const OutputConfig& projectorNamed(const ProjectorConfig& config, const std::string& path,
                                   const std::string& name);

}  // namespace afterglow::nodes
