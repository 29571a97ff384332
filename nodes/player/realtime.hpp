/// \file
/// SCHED_FIFO for a process that has to be on time, where the machine permits it (ulimit -r,
/// CAP_SYS_NICE).
#pragma once

#include <string>

namespace afterglow::nodes {

/// While it lives, the threads of the process (roscpp's send the published messages) are scheduled
/// by SCHED_FIFO, the thread that made it before the others. Threads started meanwhile are not,
/// until extend(); programs started by them never are.
class RealtimeScope {
 public:
  RealtimeScope();
  ~RealtimeScope();
  RealtimeScope(const RealtimeScope&) = delete;
  RealtimeScope& operator=(const RealtimeScope&) = delete;

  /// Extends it to the threads that have begun since. The thread that made it.
  void extend();

  /// "SCHED_FIFO", or "normal: why not".
  const std::string& description() const { return description_; }

 private:
  std::string description_;
  bool is_active_ = false;
};

}  // namespace afterglow::nodes
