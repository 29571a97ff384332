/// \file
/// Where the configuration's surfaces are now.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "nodes/projector/found_surfaces.hpp"
#include "nodes/projector/frame_lookup.hpp"
#include "nodes/projector/surface_config.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// One thread at a time.
class SceneSurfaces {
 public:
  explicit SceneSurfaces(const std::vector<SurfaceConfig>& configs);

  /// What was found of a surface, from now on; or why it was not, for the while that nothing is.
  void take(std::size_t surface, const Finding& finding);
  /// Looks up all of them; `problems` gets a line for each that is not known.
  void update(FrameLookup& frames, std::vector<std::string>& problems);

  /// As of the last update(); absent while unknown.
  const std::optional<render::SurfacePatch>& operator[](std::size_t surface) const {
    return patches_[surface];
  }
  std::vector<render::SurfacePatch> known() const;

 private:
  std::vector<SurfaceConfig> configs_;
  std::vector<Finding> findings_;
  std::vector<std::optional<render::SurfacePatch>> patches_;
};

}  // namespace afterglow::nodes
