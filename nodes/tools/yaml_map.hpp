/// \file
/// Strict reading of YAML maps: unknown or wrong content is refused with file and line.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "calib/yaml_source.hpp"

namespace afterglow::nodes {

using calib::loadYaml;

/// "; did you mean 'color'?": the nearest candidate, or all of them if none is near.
std::string advice(const std::string& wrong, const std::vector<std::string>& candidates);

/// A map of a configuration file. `where` names it for people ("layer 2"); everything throws
/// std::runtime_error "FILE:LINE: text".
class YamlMap {
 public:
  /// Refuses a node that is no map, keys other than these, and keys given twice.
  YamlMap(std::string file, const YAML::Node& node, std::string where,
          const std::vector<std::string>& keys);

  bool has(const std::string& key) const { return node()[key].IsDefined(); }
  /// The value; refused if missing.
  YAML::Node at(const std::string& key) const { return source_.at(node(), key, where_); }
  std::string text(const std::string& key) const;  ///< not empty
  double number(const std::string& key, double least, double greatest) const;
  double number(const std::string& key, double least, double greatest, double otherwise) const;
  /// Coordinates: exactly `count` finite numbers.
  std::vector<double> numbers(const YAML::Node& node, const std::string& what,
                              std::size_t count) const;
  /// The position of the key's value in `names`.
  std::size_t choice(const std::string& key, const std::vector<std::string>& names) const;

  /// A map within this one's file.
  YamlMap map(const YAML::Node& node, std::string where,
              const std::vector<std::string>& keys) const {
    return {source_.path(), node, std::move(where), keys};
  }

  const std::string& where() const { return where_; }
  const YAML::Node& node() const { return source_.root(); }
  [[noreturn]] void fail(const YAML::Node& at, const std::string& text) const {
    source_.refuse(at, text);
  }

 private:
  calib::YamlSource source_;  ///< the file, and the map as its root
  std::string where_;
};

}  // namespace afterglow::nodes
