/// \file
/// A message of a type that is known at run time only, for roscpp to publish: topic_tools'
/// ShapeShifter without topic_tools. C++14 (guard_messages.hpp).
#pragma once

#include <ros/ros.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace afterglow {
namespace nodes {

struct StopMessage {
  std::string type, md5sum, definition;
  std::vector<std::uint8_t> bytes;
};

}  // namespace nodes
}  // namespace afterglow

namespace ros {
namespace message_traits {

template <>
struct IsMessage<afterglow::nodes::StopMessage> : TrueType {};
template <>
struct IsMessage<const afterglow::nodes::StopMessage> : TrueType {};

template <>
struct MD5Sum<afterglow::nodes::StopMessage> {
  static const char* value() { return "*"; }
  static const char* value(const afterglow::nodes::StopMessage& message) {
    return message.md5sum.c_str();
  }
};

template <>
struct DataType<afterglow::nodes::StopMessage> {
  static const char* value() { return "*"; }
  static const char* value(const afterglow::nodes::StopMessage& message) {
    return message.type.c_str();
  }
};

template <>
struct Definition<afterglow::nodes::StopMessage> {
  static const char* value() { return ""; }
  static const char* value(const afterglow::nodes::StopMessage& message) {
    return message.definition.c_str();
  }
};

}  // namespace message_traits

namespace serialization {

template <>
struct Serializer<afterglow::nodes::StopMessage> {
  template <typename Stream>
  static void write(Stream& stream, const afterglow::nodes::StopMessage& message) {
    const std::uint32_t size = serializedLength(message);
    if (size > 0) std::memcpy(stream.advance(size), message.bytes.data(), size);
  }
  static std::uint32_t serializedLength(const afterglow::nodes::StopMessage& message) {
    return static_cast<std::uint32_t>(message.bytes.size());
  }
};

}  // namespace serialization
}  // namespace ros
