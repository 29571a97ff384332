/// \file
/// Message definitions of ROS 2 in terms of ROS 1. Internal to replay. Source of the grammar:
/// docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html.
/// Known as well, although a bag does not hold them: the types of ROS 1's common packages, most of
/// which differ by the header's `seq` alone.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "replay/messages/definitions.hpp"

namespace afterglow::replay {

/// "geometry_msgs/Twist" of "geometry_msgs/msg/Twist". Throws MessageError if it is no type's name.
std::string ros1TypeName(const std::string& ros2_type);

/// "geometry_msgs/msg/Twist" of "geometry_msgs/Twist".
std::string ros2TypeName(const std::string& ros1_type);

/// The name in ROS 1 of a field of a ROS 2 type, and in ROS 2 of one of a ROS 1 type,
/// "package/Type": ROS 2 does not allow all of them as they are.
std::string nameInRos1(const std::string& type, const std::string& field);
std::string nameInRos2(const std::string& type, const std::string& field);

/// The most that a field of ROS 2 may hold; 0: as much as there is.
struct Ros2Bound {
  std::size_t elements = 0;
  std::size_t letters = 0;  ///< bytes of each string
};
/// Bounds by a field's type, "package/Type", and its name.
using Ros2Bounds = std::map<std::pair<std::string, std::string>, Ros2Bound>;

/// The ROS 1 definition that has the fields of a ROS 2 definition (with those of all contained
/// types, as bags of ROS 2 and MCAP files have it): builtin_interfaces/Time and Duration are `time`
/// and `duration`, std_msgs/Header gains `seq`, default values are gone, and so are bounds, which
/// `bounds` gets. Throws MessageError for what ROS 1 has not, as wstring.
std::string ros1Definition(const std::string& ros2_type, std::string_view ros2_definition,
                           Ros2Bounds* bounds = nullptr);

/// The definition as ROS 2 writes it that has the fields of a ROS 1 definition, with those of all
/// contained types: what ros1Definition() does, the other way round.
std::string ros2Definition(const std::string& ros1_type, std::string_view ros1_definition);

/// A definition whose messages no ROS 1 robot may be sent, as its type has other fields there or is
/// unknown; says so in its first line.
std::string markAsForeign(const std::string& definition, const std::string& why);
/// Returns why; empty: the definition is not marked.
std::optional<std::string> whyForeign(std::string_view definition);

/// ROS 1 definitions, as of ros1Definition(), of the layouts that the type had in releases of ROS 2
/// which write no definitions (up to Humble); the newest first. `known` is ROS 1's. Empty: none is
/// known to be right.
std::vector<std::string> ros2Layouts(const std::string& type, const Definition& known);

}  // namespace afterglow::replay
