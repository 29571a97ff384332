/// \file
/// Messages of any type, as they came.
#pragma once

#include <ros/ros.h>
#include <topic_tools/shape_shifter.h>

#include <cstdint>

#include "replay/messages/message.hpp"

namespace afterglow::nodes {

/// A message with its sender.
using AnyMessage = ros::MessageEvent<const topic_tools::ShapeShifter>;

inline replay::Bytes bytesOf(const topic_tools::ShapeShifter& message) {
  replay::Bytes bytes(message.size());
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  message.write(stream);
  return bytes;
}

}  // namespace afterglow::nodes
