/// \file
/// A projector's light as markers, for RViz: the beam of its lens, and the outlines of the surfaces
/// that catch it.
#pragma once

#include <visualization_msgs/MarkerArray.h>

#include <string>
#include <vector>

#include "calib/lens.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// The beam as far as `distance` (m, more than 0) along the optical axis: translucent sides (id 0)
/// and its edges (id 1), of namespace `name`. In the projector's optical frame, which they follow.
/// As the lens bends it; what no ray of the lens reaches is left out. Pure.
visualization_msgs::MarkerArray beamMarkers(const calib::Lens& lens, const std::string& frame,
                                            const std::string& name, double distance);

/// The outlines of surfaces, in the fixed frame, each a marker of namespace `surfaces` behind one
/// that deletes all. Endless surfaces have none. Pure.
visualization_msgs::MarkerArray surfaceMarkers(const std::vector<render::SurfacePatch>& surfaces,
                                               const std::string& fixed_frame);

}  // namespace afterglow::nodes
