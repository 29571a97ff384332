/// \file
/// The words of Afterglow's nodes about themselves, a line each: for `afterglow watch`.
#pragma once

#include <afterglow/ReplayStatus.h>
#include <diagnostic_msgs/DiagnosticArray.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "nodes/tools/diagnostics.hpp"

namespace afterglow::nodes {

/// The state of a node or a part of it.
struct WatchLine {
  enum class Level { Ok, Warning, Error };
  std::string name;  ///< "projector_node: /cloud"
  Level level = Level::Ok;
  std::string text;
  std::map<std::string, std::string> values;  ///< values as they were published

  /// "ok    projector_node: /cloud: 2 shown".
  std::string words() const;
  /// The same for lines whose numbers alone differ: no change is worth a line then.
  std::string kind() const;
};

/// Keeps the last word of every node, in a bounded number of lines. Times are steady ns. One thread
/// at a time.
class WatchView {
 public:
  /// Diagnostics come once a second: who is silent for longer hangs, is gone or is cut off.
  static constexpr std::int64_t kSilenceNs = 4'000'000'000;

  WatchView();

  /// Statuses of Afterglow's own nodes; a robot's others are passed over.
  void take(const diagnostic_msgs::DiagnosticArray& message, std::int64_t now_ns);
  /// `node`: without leading slash.
  void take(const std::string& node, const ReplayStatus& status, std::int64_t now_ns);

  /// Returns the lines in the order of their names.
  std::vector<WatchLine> lines(std::int64_t now_ns) const;

 private:
  struct Said {
    WatchLine line;
    std::int64_t at_ns = 0;
    bool is_regular = true;  ///< silence is a fault
  };
  Said* find(const std::string& name);

  HeardStatuses statuses_;
  std::map<std::string, Said> said_;
};

}  // namespace afterglow::nodes
