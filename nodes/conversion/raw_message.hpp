/// \file
/// A message of any type as roscpp's subscriptions take it: its bytes, copied once.
#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include "replay/messages/message.hpp"

namespace afterglow::nodes {

struct RawMessage {
  replay::Bytes bytes;
};

}  // namespace afterglow::nodes

namespace ros {
namespace message_traits {

template <>
struct IsMessage<afterglow::nodes::RawMessage> : TrueType {};

/// "*": whatever the publisher has.
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
};

}  // namespace serialization
}  // namespace ros
