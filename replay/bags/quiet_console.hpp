/// \file
/// Silence while rosbag_storage works: it logs to stderr what it also throws. Internal to replay.
#pragma once

#include <console_bridge/console.h>

namespace afterglow::replay {

/// Restores the log level when it goes.
class QuietConsole {
 public:
  QuietConsole() : previous_(console_bridge::getLogLevel()) {
    console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_NONE);
  }
  QuietConsole(const QuietConsole&) = delete;
  QuietConsole& operator=(const QuietConsole&) = delete;
  ~QuietConsole() { console_bridge::setLogLevel(previous_); }

 private:
  console_bridge::LogLevel previous_;
};

}  // namespace afterglow::replay
