/// \file
/// Messages of ROS as the store keeps them.
#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <cstdint>
#include <string>

#include "replay/messages/message.hpp"

namespace afterglow::test {

/// Not inlined: GCC 12 would take a blank message's empty strings for an overflow.
template <typename Ros>
[[gnu::noinline]] replay::Bytes rosBytes(const Ros& message) {
  replay::Bytes bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

template <typename Ros>
replay::Channel rosChannel(const std::string& topic) {
  namespace traits = ros::message_traits;
  return {topic, traits::DataType<Ros>::value(), traits::MD5Sum<Ros>::value(),
          traits::Definition<Ros>::value(), false, "/recorded"};
}

}  // namespace afterglow::test
