/// \file
/// Names of tf frames that tf2 takes.
#pragma once

#include <string>

namespace afterglow::nodes {

/// Returns true if tf2 looks a frame of this name up: it is not empty and begins with no slash.
/// Asked for another one, tf2 warns each time.
inline bool isFrameName(const std::string& name) { return !name.empty() && name.front() != '/'; }

}  // namespace afterglow::nodes
