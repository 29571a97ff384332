#include "nodes/verbs/checkup.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace afterglow::nodes {
namespace {

const char* name(Checkup::Level level) {
  static const char* const kNames[] = {"ok", "advice", "problem"};
  return kNames[static_cast<int>(level)];
}

}  // namespace

std::string Checkup::words() const {
  return fmt::format("{:9}{}: {}{}{}", nodes::name(level), name, found, advice.empty() ? "" : "; ",
                     advice);
}

nlohmann::ordered_json Checkup::json() const {
  nlohmann::ordered_json json;
  json["name"] = name;
  json["level"] = nodes::name(level);
  json["found"] = found;
  json["advice"] = advice;
  return json;
}

std::size_t countOf(Checkup::Level level, const std::vector<Checkup>& findings) {
  return static_cast<std::size_t>(
      std::count_if(findings.begin(), findings.end(),
                    [&](const Checkup& finding) { return finding.level == level; }));
}

}  // namespace afterglow::nodes
