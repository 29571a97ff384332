/// \file
/// The pictures of a behavior's page.
#pragma once

#include <vector>

#include "nodes/console/behavior_page.hpp"
#include "nodes/console/picture_source.hpp"

namespace afterglow::nodes {

/// Of its key moments what the projector showed and, where it can be drawn, the room.
std::vector<MomentImage> keyImages(const BehaviorDetail& detail, PictureSource& pictures);

}  // namespace afterglow::nodes
