/// \file
/// The command line of `afterglow play`: the options of nodes/player/play_options.hpp, and those of
/// the command itself; the table of `--classes`.
///
/// Keys and the status line of `afterglow play`, where there is a terminal.
#pragma once

#include <termios.h>

#include <CLI/App.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "nodes/player/play_options.hpp"
#include "nodes/player/replay_session.hpp"
#include "replay/plan/robot_profile.hpp"

namespace afterglow::nodes {

/// Returns the table of topics' classes (assets/topics.yaml, replay/plan/permission.hpp) for
/// people: an entry a row, in the order in which they count; names and types as TopicRow has them.
/// First what the robot's profile adds.
std::string topicClassesText(const replay::RobotTopics& robot);

/// An array of {class, topics, types, but (other types), why, stop (null: none is known or needed),
/// by_name}.
nlohmann::ordered_json topicClassesJson(const replay::RobotTopics& robot);

struct PlayCommand {
  std::string store, report_file;
  std::vector<std::string> behaviors;  ///< the words of one, or several ids
  bool is_dry_run = false, is_json = false, is_quiet = false, has_no_keys = false;
  std::map<const PlayOption*, OptionTexts> given;

  /// Returns the request that was given. Throws std::runtime_error and std::invalid_argument, one
  /// line.
  ReplayRequest request() const;
};

/// `command` has to live until the command line is read.
void addPlayOptions(CLI::App& verb, PlayCommand& command);

/// The keys' meanings, one line.
constexpr const char* kPlayKeys =
    "space pause, s step, left/right 5 s back/on, up/down (+/-) rate, t pause topics, q quit";

/// Keys as they are pressed, if standard input is a terminal and this process is in its
/// foreground.
class Keyboard {
 public:
  explicit Keyboard(bool is_wanted);
  ~Keyboard();
  Keyboard(const Keyboard&) = delete;
  Keyboard& operator=(const Keyboard&) = delete;

  bool isActive() const { return is_active_; }
  /// A character, or "up", "down", "left", "right"; empty: none was pressed.
  std::string key();
  /// The terminal is as it was, and no key is heard any more. So it ends, too.
  void release();

 private:
  bool is_active_ = false;
  termios before_{};
  std::string pressed_;  ///< not looked at yet
};

/// Does what a key says; the answer is for the status line. Nothing for unknown keys.
std::string followKey(const std::string& key, ReplaySession& session);

/// " [PLAYING]  12.34 / 60.00 s  rate 1.00  12 messages"
std::string statusText(const ReplaySession& session);

}  // namespace afterglow::nodes
