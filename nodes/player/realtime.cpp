#include "nodes/player/realtime.hpp"

#include <sched.h>
#include <sys/syscall.h>
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

void scheduleOthers(pid_t self, int policy, int priority) {
  std::error_code error;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", error)) {
    const pid_t thread = std::atoi(task.path().filename().c_str());
    if (thread != self) schedule(thread, policy, priority);
  }
}

}  // namespace

RealtimeScope::RealtimeScope() {
  const auto self = static_cast<pid_t>(syscall(SYS_gettid));
  is_active_ = schedule(self, SCHED_FIFO, kOwnPriority);
  description_ = is_active_ ? "SCHED_FIFO"
                            : std::string("normal: SCHED_FIFO is refused (") +
                                  std::strerror(errno) + "; see ulimit -r)";
  extend();
}

void RealtimeScope::extend() {
  const auto self = static_cast<pid_t>(syscall(SYS_gettid));
  if (is_active_) scheduleOthers(self, SCHED_FIFO, kOtherPriority);
}

RealtimeScope::~RealtimeScope() {
  if (is_active_) {
    const auto self = static_cast<pid_t>(syscall(SYS_gettid));
    scheduleOthers(self, SCHED_OTHER, 0);
    schedule(self, SCHED_OTHER, 0);
  }
}

}  // namespace afterglow::nodes
