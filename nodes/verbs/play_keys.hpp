/// \file
/// Keys and the status line of `afterglow play`, where there is a terminal.
#pragma once

#include <termios.h>

#include <string>

#include "nodes/player/replay_session.hpp"

namespace afterglow::nodes {

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
