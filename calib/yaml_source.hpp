/// \file
/// Strict reading of YAML files: unknown or wrong content is refused with file and line.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <utility>
#include <vector>

namespace afterglow::calib {

/// A whole file. Throws std::runtime_error "FILE: cannot be read" or "FILE:LINE: why it is no
/// YAML".
YAML::Node loadYaml(const std::string& path);

/// Reads files whose refusals name keys, not lines: throws "FILE: cannot be read" or "FILE: is not
/// YAML: why".
YAML::Node loadYamlValues(const std::string& path);

/// "KEY: line 3 has "abc", WANTED"; `other` is said of a value that is no text.
std::string yamlMisfit(const std::string& key, const YAML::Node& value, const std::string& wanted,
                       const std::string& other);

/// Advice on an unknown key: "; known: a, b".
using KeyAdvice = std::string (*)(const std::string& wrong, const std::vector<std::string>& known);
std::string knownKeys(const std::string& wrong, const std::vector<std::string>& known);

/// A file whose complaints begin with its name and the line: everything throws std::runtime_error
/// "FILE:LINE: text". `what` and `where` name a value and a map for people ("'size_m'", "a tag").
class YamlSource {
 public:
  /// Throws as loadYaml does.
  explicit YamlSource(const std::string& path) : YamlSource(path, loadYaml(path)) {}
  /// Takes a file that was read already.
  YamlSource(std::string path, const YAML::Node& root) : path_(std::move(path)), root_(root) {}

  const std::string& path() const { return path_; }
  const YAML::Node& root() const { return root_; }

  [[noreturn]] void refuse(const YAML::Node& at, const std::string& text) const;

  /// Refuses a node that is no map, keys other than these, and keys given twice.
  void requireKeys(const YAML::Node& map, const std::string& where,
                   const std::vector<std::string>& known, KeyAdvice advice = knownKeys) const;
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
