/// \file
/// Velocities with a header and without: since Jazzy, controllers of ROS 2 want
/// geometry_msgs/TwistStamped where those of ROS 1 want Twist.
#pragma once

#include <string>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// "geometry_msgs/TwistStamped" of "geometry_msgs/Twist", and the other way round; empty for other
/// types.
std::string otherTwist(const std::string& ros1_type);

/// The same velocity as a message of the other type, both in ROS 1's bytes: with a header of no
/// frame, stamped `now`, or without one. Throws MessageError for bytes that are no message of
/// `ros1_type`.
Bytes toOtherTwist(const std::string& ros1_type, const Bytes& bytes, Stamp now);

}  // namespace afterglow::replay
