#include "nodes/verbs/play_command.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/Error.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <stdexcept>
#include <string_view>
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

namespace {

constexpr double kLeapSeconds = 5, kRateStep = 1.1;

/// The bytes that a terminal sends for an arrow, before its letter (ECMA-48's cursor keys).
constexpr std::string_view kArrow = "\x1b[";

std::string arrowName(char letter) {
  return letter == 'A'   ? "up"
         : letter == 'B' ? "down"
         : letter == 'C' ? "right"
         : letter == 'D' ? "left"
                         : "";
}

std::string leap(ReplaySession& session, double seconds) {
  const replay::PlayPlan& plan = session.plan();
  const auto into = [&](replay::Stamp stamp) {
    return replay::PlaybackTime{stamp.ns - plan.behavior.begin.ns}.seconds();
  };
  const double to =
      std::clamp(session.progress().position.seconds() + seconds, into(plan.begin), into(plan.end));
  session.tell([&](replay::Player& player) { player.seek({static_cast<std::int64_t>(to * 1e9)}); });
  return "";
}

std::string act(const std::string& key, ReplaySession& session) {
  if (key == " ") {
    session.pause(!session.isPaused());
  } else if (key == "s") {
    session.tell([](replay::Player& player) { player.playNext(1); });
  } else if (key == "left" || key == "right") {
    return leap(session, key == "left" ? -kLeapSeconds : kLeapSeconds);
  } else if (key == "up" || key == "+") {
    session.setRate(session.progress().rate * kRateStep);
  } else if (key == "down" || key == "-") {
    session.setRate(session.progress().rate / kRateStep);
  } else if (key == "t") {
    const bool pauses =
        session.tell([](replay::Player& player) { return player.togglePauseTopics(); });
    return pauses ? "pauses at pause topics" : "plays through pause topics";
  } else if (key == "q") {
    session.stop("stopped by a key");
  }
  return "";
}

}  // namespace

Keyboard::Keyboard(bool is_wanted) {
  const bool is_foreground = isatty(STDIN_FILENO) != 0 && tcgetpgrp(STDIN_FILENO) == getpgrp();
  if (!is_wanted || !is_foreground || tcgetattr(STDIN_FILENO, &before_) != 0) {
    return;
  }
  termios raw = before_;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);  // Ctrl-C stays what it is
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  is_active_ = tcsetattr(STDIN_FILENO, TCSANOW, &raw) == 0;
}

Keyboard::~Keyboard() { release(); }

void Keyboard::release() {
  if (is_active_) tcsetattr(STDIN_FILENO, TCSANOW, &before_);
  is_active_ = false;
}

std::string Keyboard::key() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  char bytes[64];
  if (is_active_ && poll(&input, 1, 0) > 0) {
    const ssize_t count = read(STDIN_FILENO, bytes, sizeof(bytes));
    pressed_.append(bytes, count > 0 ? static_cast<std::size_t>(count) : 0);
  }
  const std::string arrow = pressed_.substr(0, kArrow.size() + 1);
  const bool is_arrow =
      arrow.size() > kArrow.size() && arrow.compare(0, kArrow.size(), kArrow) == 0;
  const std::string key = is_arrow ? arrowName(arrow.back()) : pressed_.substr(0, 1);
  pressed_.erase(0, is_arrow ? arrow.size() : 1);
  return key;
}

std::string followKey(const std::string& key, ReplaySession& session) {
  try {
    return act(key, session);
  } catch (const std::exception& error) {
    return error.what();
  }
}

std::string statusText(const ReplaySession& session) {
  const replay::PlayProgress progress = session.progress();
  const bool is_idle = progress.state == replay::PlayProgress::State::Idle;
  const char* state = is_idle && session.goesToStart()                        ? "TO START"
                      : is_idle                                               ? "WAITING"
                      : progress.state == replay::PlayProgress::State::Paused ? "PAUSED "
                      : progress.is_held                                      ? "DELAYED"
                                                                              : "PLAYING";
  const double end = replay::PlaybackTime{session.plan().durationNs()}.seconds();
  const std::string waits_for = session.waitsFor();
  return fmt::format(" [{}]  {:.2f} / {:.2f} s  rate {:.2f}  {} messages{}", state,
                     progress.position.seconds(), end, progress.rate, progress.published,
                     waits_for.empty() ? "" : "  the base waits: " + waits_for);
}

}  // namespace afterglow::nodes
