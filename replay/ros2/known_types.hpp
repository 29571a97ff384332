/// \file
/// Types whose ROS 2 definition is known although a bag does not hold it: those of ROS 1's common
/// packages, most of which differ by the header's `seq` alone. Internal to replay.
#pragma once

#include <string>
#include <vector>

#include "replay/messages/definitions.hpp"

namespace afterglow::replay {

/// ROS 1 definitions, as of ros1Definition(), of the layouts that the type had in releases of ROS 2
/// which write no definitions (up to Humble); the newest first. `known` is ROS 1's. Empty: none is
/// known to be right.
std::vector<std::string> ros2Layouts(const std::string& type, const Definition& known);

}  // namespace afterglow::replay
