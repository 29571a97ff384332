#include "replay/store/sqlite/behavior_row.hpp"

#include <nlohmann/json.hpp>

namespace afterglow::replay {
namespace {

std::vector<std::string> parseStrings(const std::string& array) {
  std::vector<std::string> strings;
  if (array == "[]") return strings;
  const auto json = nlohmann::json::parse(array, nullptr, false);
  for (const auto& element : json) {
    if (element.is_string()) strings.push_back(element.get<std::string>());
  }
  return strings;
}

}  // namespace

Behavior readBehavior(const SqliteStatement& row) {
  Behavior behavior;
  behavior.id = row.integer(0);
  behavior.recording = row.integer(1);
  behavior.name = row.text(2);
  behavior.tree_path = row.text(3);
  behavior.parent = row.integer(4);
  behavior.attempt = static_cast<int>(row.integer(5));
  behavior.outcome = row.text(6);
  behavior.begin = {row.integer(7)};
  if (const auto end_ns = row.optionalInteger(8)) behavior.end = Stamp{*end_ns};
  behavior.robot = row.text(9);
  behavior.parameters = row.text(10);
  behavior.tags = parseStrings(row.text(11));
  behavior.calibration = row.text(12);
  behavior.topics = parseStrings(row.text(13));
  behavior.key = row.text(14);
  behavior.wall_begin = {row.integer(15)};
  behavior.snapshot = row.text(16);
  behavior.remarks = parseStrings(row.text(17));
  return behavior;
}

}  // namespace afterglow::replay
