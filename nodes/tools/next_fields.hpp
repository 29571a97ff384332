/// \file
/// Serialization of messages that are declared by hand. C++14, as afterglow_guard is built on
/// robots with old systems, too.
#pragma once

#include <ros/serialization.h>

namespace afterglow {
namespace nodes {

/// Reads or writes fields in this order.
template <typename Stream, typename... Fields>
void nextFields(Stream& stream, Fields&... fields) {
  const int each[] = {(stream.next(fields), 0)...};
  (void)each;
}

}  // namespace nodes
}  // namespace afterglow

/// Serializes a type's fields, of `message`, in this order. For the namespace ros::serialization.
#define AFTERGLOW_SERIALIZED(Type, ...)                           \
  template <>                                                     \
  struct Serializer<Type> {                                       \
    template <typename Stream, typename Message>                  \
    static void allInOne(Stream& stream, Message message) {       \
      afterglow::nodes::nextFields(stream, __VA_ARGS__);          \
    }                                                             \
    ROS_DECLARE_ALLINONE_SERIALIZER                               \
  };
