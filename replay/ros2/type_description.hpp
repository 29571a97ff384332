/// \file
/// What a node of ROS 2 (Iron and later) tells of a type: its service `~/get_type_description`, of
/// the type kTypeDescriptionService. Source: type_description_interfaces, REP 2016.
#pragma once

#include <string>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

inline constexpr const char* kTypeDescriptionService =
    "type_description_interfaces/srv/GetTypeDescription";

/// The request, in CDR. `type`: "geometry_msgs/msg/Twist"; `hash`: "RIHS01_...", as the node's
/// reader or writer tells it.
Bytes typeDescriptionRequest(const std::string& type, const std::string& hash);

/// The definition in a reply, with those of all contained types, as ros1Definition() reads it: the
/// files of the node's packages, or, without them, lines made of the fields. Throws MessageError
/// with the node's reason, or naming a field that messages have not.
std::string definitionIn(const Bytes& reply);

}  // namespace afterglow::replay
