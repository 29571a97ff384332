#include "nodes/tools/yaml_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "replay/query/nearest.hpp"

namespace afterglow::nodes {

std::string advice(const std::string& wrong, const std::vector<std::string>& candidates) {
  using replay::editDistance;
  const auto nearest = std::min_element(candidates.begin(), candidates.end(),
                                        [&wrong](const auto& a, const auto& b) {
                                          return editDistance(wrong, a) < editDistance(wrong, b);
                                        });
  if (nearest == candidates.end()) return {};
  if (editDistance(wrong, *nearest) <= std::max<std::size_t>(1, nearest->size() / 2)) {
    return "; did you mean '" + *nearest + "'?";
  }
  return calib::knownKeys(wrong, candidates);
}

YamlMap::YamlMap(std::string file, const YAML::Node& node, std::string where,
                 const std::vector<std::string>& keys)
    : source_(std::move(file), node), where_(std::move(where)) {
  if (!node.IsMap()) fail(node, where_ + " should be a map of keys and values");
  for (const auto& entry : node) {
    if (!entry.first.IsScalar()) fail(entry.first, "a key in " + where_ + " is no text");
  }
  source_.requireKeys(node, where_, keys, advice);
}

std::string YamlMap::text(const std::string& key) const {
  return source_.text(at(key), "'" + key + "' of " + where_);
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
