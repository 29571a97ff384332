#include "nodes/player/realtime.hpp"

#include <sched.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace afterglow::nodes {
namespace {

constexpr int kOwnPriority = 20, kOtherPriority = 10;

/// False for a thread that has ended meanwhile, or where it is not permitted: see errno.
bool schedule(pid_t thread, int policy, int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  return sched_setscheduler(thread, policy | SCHED_RESET_ON_FORK, &parameters) == 0;
}

void scheduleOthers(int policy, int priority) {
  std::error_code error;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", error)) {
    const pid_t thread = std::atoi(task.path().filename().c_str());
    if (thread != gettid()) schedule(thread, policy, priority);
  }
}

}  // namespace

RealtimeScope::RealtimeScope() {
  is_active_ = schedule(gettid(), SCHED_FIFO, kOwnPriority);
  description_ = is_active_ ? "SCHED_FIFO"
                            : std::string("normal: SCHED_FIFO is refused (") +
                                  std::strerror(errno) + "; see ulimit -r)";
  extend();
}

void RealtimeScope::extend() {
  if (is_active_) scheduleOthers(SCHED_FIFO, kOtherPriority);
}

RealtimeScope::~RealtimeScope() {
  if (!is_active_) return;
  scheduleOthers(SCHED_OTHER, 0);
  schedule(gettid(), SCHED_OTHER, 0);
}

}  // namespace afterglow::nodes
