#include "nodes/verbs/topic_classes.hpp"

#include <fmt/format.h>

#include <utility>
#include <vector>

#include "replay/plan/permission.hpp"
#include "replay/plan/topic_role.hpp"

namespace afterglow::nodes {
namespace {

/// The word for a class by the profile: where it is stricter, or the table knows how such motion is
/// stopped.
constexpr const char* kOfProfile = "the robot's profile says so, where it may";

/// Empty for what moves nothing.
std::string stopOf(const replay::TopicRow& row) {
  replay::MotionStop stop;
  stop.kind = row.role.stop;
  const bool moves = stop.kind != replay::StopKind::None ||
                     row.role.topic_class == replay::TopicClass::Endless;
  return moves ? describe(stop) : "";
}

std::string line(const char* title, const std::vector<std::string>& patterns) {
  return patterns.empty() ? "" : fmt::format("  {:7}{}\n", title, fmt::join(patterns, ", "));
}

}  // namespace

std::string topicClassesText(const replay::RobotTopics& robot) {
  std::string text =
      "The first that fits counts. * stands for any characters; namespaces may stand before a "
      "topic.\n";
  for (const auto& [topic_class, names] : robot.words()) {
    if (names.empty()) continue;
    text += fmt::format("\n{}: {}\n", name(topic_class), kOfProfile);
    text += line("topics", names);
  }
  for (const replay::TopicRow& row : replay::TopicTable::ofAllRobots().rows) {
    text += fmt::format("\n{}: {}{}\n", name(row.role.topic_class), row.role.why,
                        row.is_by_name ? " (played only if it is named)" : "");
    text += line("topics", row.names) + line("types", row.types) + line("but", row.other_types);
    if (const std::string stop = stopOf(row); !stop.empty()) text += "  stop   " + stop + "\n";
  }
  return text + "\nWhat is published:\n\n" + replay::permissionTable();
}

nlohmann::ordered_json topicClassesJson(const replay::RobotTopics& robot) {
  auto rows = nlohmann::ordered_json::array();
  for (const auto& [topic_class, names] : robot.words()) {
    if (names.empty()) continue;
    rows.push_back({{"class", std::string(name(topic_class))},
                    {"topics", names},
                    {"types", std::vector<std::string>()},
                    {"but", std::vector<std::string>()},
                    {"why", kOfProfile},
                    {"stop", nullptr},
                    {"by_name", false}});
  }
  for (const replay::TopicRow& row : replay::TopicTable::ofAllRobots().rows) {
    nlohmann::ordered_json stop;  // null
    if (std::string text = stopOf(row); !text.empty()) stop = std::move(text);
    rows.push_back({{"class", std::string(name(row.role.topic_class))},
                    {"topics", row.names},
                    {"types", row.types},
                    {"but", row.other_types},
                    {"why", row.role.why},
                    {"stop", stop},
                    {"by_name", row.is_by_name}});
  }
  return rows;
}

}  // namespace afterglow::nodes
