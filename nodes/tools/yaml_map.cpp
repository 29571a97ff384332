#include "nodes/tools/yaml_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <set>
#include <stdexcept>
#include <utility>

namespace afterglow::nodes {

std::size_t editDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({row[j + 1] + 1, row[j] + 1, replaced});
    }
  }
  return row.back();
}

std::string advice(const std::string& wrong, const std::vector<std::string>& candidates) {
  const auto nearest = std::min_element(candidates.begin(), candidates.end(),
                                        [&wrong](const auto& a, const auto& b) {
                                          return editDistance(wrong, a) < editDistance(wrong, b);
                                        });
  if (nearest == candidates.end()) return {};
  if (editDistance(wrong, *nearest) <= std::max<std::size_t>(1, nearest->size() / 2)) {
    return "; did you mean '" + *nearest + "'?";
  }
  return fmt::format("; known: {}", fmt::join(candidates, ", "));
}

YAML::Node loadYaml(const std::string& path) {
  std::ifstream stream(path);
  if (!stream || std::filesystem::is_directory(path)) {
    throw std::runtime_error(path + ": cannot be read");
  }
  try {
    return YAML::Load(stream);
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(fmt::format("{}:{}: {}", path, error.mark.line + 1, error.msg));
  }
}

YamlMap::YamlMap(std::string file, const YAML::Node& node, std::string where,
                 const std::vector<std::string>& keys)
    : file_(std::move(file)), node_(node), where_(std::move(where)) {
  if (!node_.IsMap()) fail(node_, where_ + " should be a map of keys and values");
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) fail(entry.first, "a key in " + where_ + " is no text");
    const std::string& key = entry.first.Scalar();
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      fail(entry.first, "unknown key '" + key + "' in " + where_ + advice(key, keys));
    }
    if (!seen.insert(key).second) fail(entry.first, "key '" + key + "' twice in " + where_);
  }
}

void YamlMap::fail(const YAML::Node& at, const std::string& text) const {
  const YAML::Mark mark = at.Mark();
  const std::string line = mark.is_null() ? "" : ":" + std::to_string(mark.line + 1);
  throw std::runtime_error(file_ + line + ": " + text);
}

YAML::Node YamlMap::at(const std::string& key) const {
  const YAML::Node value = node_[key];
  if (!value.IsDefined()) fail(node_, "no '" + key + "' in " + where_);
  return value;
}

std::string YamlMap::text(const std::string& key) const {
  const YAML::Node value = at(key);
  if (!value.IsScalar() || value.Scalar().empty()) {
    fail(value, "'" + key + "' of " + where_ + " should be a text");
  }
  return value.Scalar();
}

double YamlMap::number(const std::string& key, double least, double greatest) const {
  const YAML::Node value = at(key);
  double number = 0;
  const bool read = value.IsScalar() && YAML::convert<double>::decode(value, number);
  if (!read || !(number >= least && number <= greatest)) {
    fail(value, fmt::format("'{}' of {} should be a number from {:g} to {:g}{}", key, where_, least,
                            greatest, value.IsScalar() ? ", not '" + value.Scalar() + "'" : ""));
  }
  return number;
}

double YamlMap::number(const std::string& key, double least, double greatest,
                       double otherwise) const {
  return has(key) ? number(key, least, greatest) : otherwise;
}

std::vector<double> YamlMap::numbers(const YAML::Node& node, const std::string& what,
                                     std::size_t count) const {
  std::vector<double> numbers;
  for (std::size_t i = 0; node.IsSequence() && i < node.size(); ++i) {
    double number = 0;
    const YAML::Node element = node[i];
    if (!element.IsScalar() || !YAML::convert<double>::decode(element, number)) break;
    if (!std::isfinite(number)) break;
    numbers.push_back(number);
  }
  if (!node.IsSequence() || numbers.size() != count || node.size() != count) {
    fail(node, fmt::format("{} should be {} numbers in brackets", what, count));
  }
  return numbers;
}

std::size_t YamlMap::choice(const std::string& key, const std::vector<std::string>& names) const {
  const std::string name = text(key);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    fail(at(key), "unknown " + key + " '" + name + "' in " + where_ + advice(name, names));
  }
  return static_cast<std::size_t>(found - names.begin());
}

}  // namespace afterglow::nodes
