/// \file
/// Names of tf frames in a projector's configuration.
#pragma once

#include <string>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/tools/yaml_map.hpp"

namespace afterglow::nodes {

/// The frame's name without the leading slash of old. Throws std::runtime_error "FILE:LINE: what is
/// wrong" for a name that tf2 does not know.
inline std::string readFrame(const YamlMap& map, const std::string& key) {
  const std::string name = frameName(map.text(key));
  if (!isFrameName(name)) {
    map.fail(map.at(key), "'" + key + "' of " + map.where() + " is no frame's name: '" +
                              map.text(key) + "'");
  }
  return name;
}

}  // namespace afterglow::nodes
