/// \file
/// Strict reading of YAML files: what is not understood is refused with file and line.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

namespace afterglow::calib {

/// A file whose complaints begin with its name and the line: everything throws std::runtime_error
/// "FILE:LINE: text". `what` and `where` name a value and a map for people ("'size_m'", "a tag").
class YamlSource {
 public:
  /// Throws "FILE: cannot be read" or "FILE:LINE: why it is no YAML".
  explicit YamlSource(const std::string& path);

  const YAML::Node& root() const { return root_; }

  [[noreturn]] void refuse(const YAML::Node& at, const std::string& text) const;

  /// Refuses what is no map, other keys than these, and keys given twice.
  void requireKeys(const YAML::Node& map, const std::string& where,
                   const std::vector<std::string>& known) const;
  /// The value; refused if missing.
  YAML::Node at(const YAML::Node& map, const std::string& key, const std::string& where) const;

  std::string text(const YAML::Node& node, const std::string& what) const;  ///< not empty
  int integer(const YAML::Node& node, const std::string& what) const;
  double number(const YAML::Node& node, const std::string& what) const;  ///< finite
  std::vector<double> numbers(const YAML::Node& node, const std::string& what,
                              std::size_t count) const;

 private:
  std::string path_;
  YAML::Node root_;
};

}  // namespace afterglow::calib
