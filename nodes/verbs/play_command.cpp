#include "nodes/verbs/play_command.hpp"

#include <fmt/format.h>

#include <CLI/Error.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <utility>
#include <vector>

#include "nodes/player/robot_file.hpp"
#include "nodes/verbs/verb_tools.hpp"
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
  const bool moves =
      stop.kind != replay::StopKind::None || row.role.topic_class == replay::TopicClass::Endless;
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

namespace {

constexpr const char* kOwnGroup = "The command";
constexpr const char* kExample =
    "Example:\n"
    "  afterglow play last failed pick --dry-run\n"
    "  afterglow play last failed pick --robot fetch --allow-motion --to-start --rate 0.5\n"
    "  The same by player_node, which has to be set to ~allow_motion and ~to_start:\n"
    "  rosservice call /player_node/play \"{selector: last failed pick, rate: 0.5}\"\n";

std::string isReportFile(const std::string& text) {
  const std::string ending = std::filesystem::path(text).extension();
  const bool is_known = ending == ".json" || ending == ".txt" || ending == ".html";
  return is_known ? "" : text + " has to end with .json, .txt or .html";
}

/// "--goal-wait"; "--no-realtime" of a flag that is set anyway.
std::string longName(const PlayOption& option) {
  const bool is_set = option.kind == PlayOption::Kind::Flag && option.otherwise == "true";
  std::string name = (is_set ? "--no-" : "--") + option.name;
  std::replace(name.begin(), name.end(), '_', '-');
  return name;
}

std::string longName(const std::string& name) {
  const auto& all = playOptions();
  return longName(*std::find_if(all.begin(), all.end(),
                                [&](const PlayOption& option) { return option.name == name; }));
}

std::string namesOf(const PlayOption& option) {
  const std::string name = longName(option);
  if (option.aliases.empty()) return name;
  const bool is_letter = option.aliases.size() == 2;
  return is_letter ? option.aliases + "," + name : name + "," + option.aliases;
}

std::string helpOf(const PlayOption& option) {
  const bool has_default = option.kind != PlayOption::Kind::Flag && !option.otherwise.empty();
  return option.help + (has_default ? "; default " + option.otherwise : "");
}

CLI::Option* addOption(CLI::App& verb, const PlayOption& option, PlayCommand& command) {
  const auto keep = [&option, &command](const OptionTexts& texts) {
    command.given[&option] = texts;
  };
  const std::string names = namesOf(option), help = helpOf(option);
  if (option.kind == PlayOption::Kind::Flag) {
    const char* meant = option.otherwise == "true" ? "false" : "true";
    return verb.add_flag_callback(names, [keep, meant] { keep({meant}); }, help);
  }
  CLI::Option* added =
      option.kind == PlayOption::Kind::List
          ? verb.add_option_function<OptionTexts>(names, keep, help)
          : verb.add_option_function<std::string>(
                names, [keep](const std::string& text) { keep({text}); }, help);
  added->type_name(option.value);
  added->check(
      CLI::Validator([&option](std::string& text) { return complaintOf(option, text); }, ""));
  if (!option.alone.empty()) added->expected(0, 1)->default_str(option.alone);
  return added;
}

void addTable(CLI::App& verb, PlayCommand& command) {
  for (const PlayOption& option : playOptions()) {
    CLI::Option* added = addOption(verb, option, command)->group(titleOf(option.group));
    if (!option.needs.empty()) added->needs(verb.get_option(longName(option.needs)));
    if (!option.excludes.empty()) added->excludes(verb.get_option(longName(option.excludes)));
  }
  for (const FormerOption& former : formerOptions()) {  // not in --help
    const auto refuse = [&former](const std::string&) {
      throw CLI::ValidationError(std::string("--") + former.name,
                                 "has become " + longName(former.now) + former.remark);
    };
    verb.add_option_function<std::string>(std::string("--") + former.name, refuse)->group("");
  }
}

/// Shows the classes before anything that is missing on the command line is missed.
[[noreturn]] void showClasses(const CLI::App& verb) {
  const replay::RobotTopics robot =
      verb.count("--robot") > 0
          ? replay::RobotTopics(findRobotProfile(verb["--robot"]->as<std::string>()))
          : replay::RobotTopics();
  if (verb.count("--json") > 0) {
    std::cout << dumpJson(topicClassesJson(robot), 2) << "\n";
  } else {
    std::cout << topicClassesText(robot);
  }
  throw CLI::Success();
}

}  // namespace

ReplayRequest PlayCommand::request() const {
  ReplayRequest request;
  for (const auto& [option, texts] : given) giveOption(request, *option, texts);
  return request;
}

void addPlayOptions(CLI::App& verb, PlayCommand& c) {
  verb.add_option("behavior", c.behaviors,
                  std::string(kBehaviorHelp) + "; several ids are played one after the other")
      ->required();
  addTable(verb, c);
  verb.option_defaults()->group(kOwnGroup);
  addStoreOption(verb, c.store);
  auto* dry_run = verb.add_flag("--dry-run", c.is_dry_run, "Show the plan; needs no ROS master");
  verb.add_flag("--json", c.is_json, "The plan of --dry-run as JSON")->needs(dry_run);
  verb.add_flag_callback("--classes", [&verb] { showClasses(verb); },
                         "Print which topics are played and why, and end; --json: as JSON");
  verb.add_option("--report", c.report_file,
                  "Write what was measured: FILE.json, FILE.txt or, with plots, FILE.html")
      ->check(isReportFile);
  verb.add_flag("-q,--quiet", c.is_quiet,
                "No status line, no remarks on the way, no table at the end");
  verb.add_flag("--no-keys", c.has_no_keys, "Leave the keyboard alone");
  verb.set_help_flag("-h,--help", "Print this help message and exit")  // anew: as the last
      ->group(kOwnGroup);
  verb.footer(kExample);
}

}  // namespace afterglow::nodes
