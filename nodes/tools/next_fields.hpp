/// \file
/// Serialization of messages that are declared by hand. C++14, as afterglow_guard is built on
/// robots with old systems, too.
#pragma once

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
