/// \file
/// Messages as bytes: as roscpp's subscriptions take them, and stored ones as the roscpp message
/// that they hold, with neither trusted.
#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>

#include "replay/messages/field_edit.hpp"
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

/// Empty if the bytes are no message of this type. Array counts are checked against the bytes
/// first, because roscpp allocates whatever a count says.
template <typename MessageType>
std::optional<MessageType> toMessage(const replay::Bytes& bytes) {
  namespace traits = ros::message_traits;
  static const replay::Schema schema = replay::Schema::parse(
      traits::DataType<MessageType>::value(), traits::Definition<MessageType>::value());
  if (!replay::fits(schema, bytes)) return std::nullopt;
  try {
    MessageType message;
    // roscpp only reads through the pointer it takes as mutable.
    ros::serialization::IStream stream(const_cast<std::uint8_t*>(bytes.data()),
                                       static_cast<std::uint32_t>(bytes.size()));
    ros::serialization::deserialize(stream, message);
    return message;
  } catch (const ros::Exception&) {
    return std::nullopt;
  }
}

/// A message of any type, to subscribe to and to publish: its bytes, copied once.
struct RawMessage {
  replay::Bytes bytes;
  /// Let go once roscpp has sent, or dropped, the message that was published.
  std::shared_ptr<const void> in_flight = {};
};

}  // namespace afterglow::nodes

namespace ros {
namespace message_traits {

template <>
struct IsMessage<afterglow::nodes::RawMessage> : TrueType {};

/// "*": any publisher's.
template <>
struct MD5Sum<afterglow::nodes::RawMessage> {
  static const char* value() { return "*"; }
  static const char* value(const afterglow::nodes::RawMessage&) { return "*"; }
};
template <>
struct DataType<afterglow::nodes::RawMessage> {
  static const char* value() { return "*"; }
  static const char* value(const afterglow::nodes::RawMessage&) { return "*"; }
};

}  // namespace message_traits

namespace serialization {

template <>
struct Serializer<afterglow::nodes::RawMessage> {
  template <class Stream>
  static void read(Stream& stream, afterglow::nodes::RawMessage& message) {
    message.bytes.assign(stream.getData(), stream.getData() + stream.getLength());
  }
  template <class Stream>
  static void write(Stream& stream, const afterglow::nodes::RawMessage& message) {
    const auto size = static_cast<std::uint32_t>(message.bytes.size());
    std::copy(message.bytes.begin(), message.bytes.end(), stream.advance(size));
  }
  static std::uint32_t serializedLength(const afterglow::nodes::RawMessage& message) {
    return static_cast<std::uint32_t>(message.bytes.size());
  }
};

/// As roscpp's own, but that the buffer holds on to `in_flight`.
template <>
inline SerializedMessage serializeMessage(const afterglow::nodes::RawMessage& message) {
  const std::uint32_t size = serializationLength(message);
  SerializedMessage serialized;
  serialized.num_bytes = size + sizeof(size);
  serialized.buf.reset(
      new std::uint8_t[serialized.num_bytes],
      [in_flight = message.in_flight](const std::uint8_t* buffer) { delete[] buffer; });
  OStream stream(serialized.buf.get(), static_cast<std::uint32_t>(serialized.num_bytes));
  serialize(stream, size);
  serialized.message_start = stream.getData();
  serialize(stream, message);
  return serialized;
}

}  // namespace serialization
}  // namespace ros
