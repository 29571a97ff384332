/// \file
/// Time as the simulated robot counts it.
#pragma once

#include <chrono>

namespace afterglow::nodes {

using Nanoseconds = std::chrono::nanoseconds;  ///< a duration, or robot time since the epoch

}  // namespace afterglow::nodes
