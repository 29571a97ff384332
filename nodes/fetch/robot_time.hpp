/// \file
/// Time as the simulated robot counts it.
#pragma once

#include <chrono>

namespace afterglow::nodes {

using Nanoseconds = std::chrono::nanoseconds;  ///< a duration, or robot time since the epoch

inline double seconds(Nanoseconds duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace afterglow::nodes
