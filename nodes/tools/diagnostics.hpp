/// \file
/// Pieces of /diagnostics.
#pragma once

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <string>

namespace afterglow::nodes {

inline void addValue(diagnostic_msgs::DiagnosticStatus& status, const std::string& key,
                     const std::string& value) {
  diagnostic_msgs::KeyValue entry;
  entry.key = key;
  entry.value = value;
  status.values.push_back(entry);
}

}  // namespace afterglow::nodes
