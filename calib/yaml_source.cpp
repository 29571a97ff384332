#include "calib/yaml_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "calib/file_replacement.hpp"
#include "calib/number_text.hpp"

namespace afterglow::calib {

YAML::Node loadYaml(const std::string& path) {
  std::ifstream stream = openRegularFile(path);
  if (!stream) throw std::runtime_error(path + ": cannot be read");
  try {
    return YAML::Load(stream);
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(fmt::format("{}:{}: {}", path, error.mark.line + 1, error.msg));
  }
}

YAML::Node loadYamlValues(const std::string& path) {
  std::ifstream stream = openRegularFile(path);
  if (!stream) throw std::runtime_error(path + ": cannot be read");
  try {
    return YAML::Load(stream);
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(path + ": is not YAML: " + error.what());
  }
}

std::string yamlMisfit(const std::string& key, const YAML::Node& value, const std::string& wanted,
                       const std::string& other) {
  return fmt::format("{}: line {} has {}, {}", key, value.Mark().line + 1,
                     value.IsScalar() ? "\"" + value.Scalar() + "\"" : other, wanted);
}

std::string knownKeys(const std::string&, const std::vector<std::string>& known) {
  return fmt::format("; known: {}", fmt::join(known, ", "));
}

void YamlSource::refuse(const YAML::Node& at, const std::string& text) const {
  const YAML::Mark mark = at.Mark();
  const std::string line = mark.is_null() ? "" : ":" + std::to_string(mark.line + 1);
  throw std::runtime_error(path_ + line + ": " + text);
}

void YamlSource::requireKeys(const YAML::Node& map, const std::string& where,
                             const std::vector<std::string>& known, KeyAdvice advice) const {
  if (!map.IsMap()) {
    refuse(map, fmt::format("{} should be a map with the keys {}", where, fmt::join(known, ", ")));
  }
  std::set<std::string> seen;
  for (const auto& entry : map) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      refuse(entry.first, "unknown key '" + key + "' in " + where + advice(key, known));
    }
    if (!seen.insert(key).second) refuse(entry.first, "key '" + key + "' twice in " + where);
  }
}

YAML::Node YamlSource::at(const YAML::Node& map, const std::string& key,
                          const std::string& where) const {
  const YAML::Node value = map[key];
  if (!value.IsDefined()) refuse(map, "no '" + key + "' in " + where);
  return value;
}

std::string YamlSource::text(const YAML::Node& node, const std::string& what) const {
  if (!node.IsScalar() || node.Scalar().empty()) refuse(node, what + " should be a text");
  return node.Scalar();
}

int YamlSource::integer(const YAML::Node& node, const std::string& what) const {
  int value = 0;
  if (!node.IsScalar() || !YAML::convert<int>::decode(node, value)) {
    refuse(node, what + " should be a whole number");
  }
  return value;
}

double YamlSource::number(const YAML::Node& node, const std::string& what) const {
  const auto value = node.IsScalar() ? numberFromText(node.Scalar()) : std::nullopt;
  if (!value) refuse(node, what + " should be a finite number");
  return *value;
}

std::vector<double> YamlSource::numbers(const YAML::Node& node, const std::string& what,
                                        std::size_t count) const {
  if (!node.IsSequence() || node.size() != count) {
    refuse(node, fmt::format("{} should be {} numbers in brackets", what, count));
  }
  std::vector<double> values;
  for (const YAML::Node& item : node) values.push_back(number(item, "every number of " + what));
  return values;
}

}  // namespace afterglow::calib
