/// \file
/// Stored bytes as the roscpp message they are, trusting neither.
#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <optional>
#include <stdexcept>

#include "replay/messages/document.hpp"
#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::nodes {

/// Throws std::runtime_error naming topic and both types if the channel holds another type.
template <typename MessageType>
void requireType(const replay::Channel& channel) {
  namespace traits = ros::message_traits;
  if (channel.md5 == traits::MD5Sum<MessageType>::value()) return;
  throw std::runtime_error("topic '" + channel.topic + "' holds " + channel.type + " (md5 " +
                           channel.md5 + "), not " + traits::DataType<MessageType>::value() +
                           " (md5 " + traits::MD5Sum<MessageType>::value() + ")");
}

/// Empty if the bytes are no message of this type. Counts are vetted against the bytes before
/// roscpp, which allocates what it is told, sees them.
template <typename MessageType>
std::optional<MessageType> toMessage(const replay::Bytes& bytes) {
  namespace traits = ros::message_traits;
  static const replay::Schema schema = replay::Schema::parse(
      traits::DataType<MessageType>::value(), traits::Definition<MessageType>::value());
  try {
    replay::decode(schema, bytes);
    MessageType message;
    // roscpp only reads through the pointer it takes as mutable.
    ros::serialization::IStream stream(const_cast<std::uint8_t*>(bytes.data()),
                                       static_cast<std::uint32_t>(bytes.size()));
    ros::serialization::deserialize(stream, message);
    return message;
  } catch (const replay::MessageError&) {
    return std::nullopt;
  } catch (const ros::Exception&) {
    return std::nullopt;
  }
}

}  // namespace afterglow::nodes
