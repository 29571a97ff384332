/// \file
/// The outcome of reading a message from the network: its value, or why there is none.
#pragma once

#include <optional>
#include <string>

namespace afterglow::nodes {

/// Messages are untrusted: a bad one is a reason to count, never an exception. The reason is a
/// stable text (no measured numbers in it), so that a stream of equal faults counts as one.
template <typename T>
struct Converted {
  std::optional<T> value;
  std::string reason;  ///< why there is no value; beside a value: what was odd about it
};

template <typename T>
Converted<T> refused(std::string reason) {
  return {std::nullopt, std::move(reason)};
}

}  // namespace afterglow::nodes
