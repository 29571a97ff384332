#include "nodes/verbs/play_keys.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>
#include <string_view>

#include "nodes/verbs/verb_tools.hpp"

namespace afterglow::nodes {
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
