#include "nodes/tools/bounded_work.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <stdexcept>

namespace afterglow::nodes {
namespace {

constexpr std::size_t kMostBytes = 1 << 16;
constexpr char kDone = '+', kFailed = '-';

/// Drivers print to stderr what its caller says better.
void silence() {
  const int nothing = ::open("/dev/null", O_RDWR);
  ::dup2(nothing, STDOUT_FILENO);
  ::dup2(nothing, STDERR_FILENO);
}

[[noreturn]] void workFor(int pipe, const std::function<std::string()>& work) {
  silence();
  std::string answer;
  try {
    answer = kDone + work();
  } catch (const std::exception& error) {
    answer = kFailed + std::string(error.what());
  }
  answer.resize(std::min(answer.size(), kMostBytes));
  for (std::size_t sent = 0; sent < answer.size();) {
    const ssize_t count = ::write(pipe, answer.data() + sent, answer.size() - sent);
    if (count <= 0) break;
    sent += static_cast<std::size_t>(count);
  }
  ::_exit(0);  // what the parent has made is the parent's to destroy
}

/// Until the other end is closed; false: the time is up.
bool readAll(int pipe, double seconds, std::string& answer) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  std::array<char, 4096> buffer;
  while (true) {
    const std::chrono::duration<double, std::milli> left = end - std::chrono::steady_clock::now();
    if (left.count() <= 0) return false;
    pollfd waiting{pipe, POLLIN, 0};
    if (::poll(&waiting, 1, static_cast<int>(std::ceil(left.count()))) <= 0) continue;
    const ssize_t count = ::read(pipe, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return true;
    answer.append(buffer.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace

std::string boundedWork(double seconds, const std::function<std::string()>& work) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error(std::strerror(errno));
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(ends[0]);
    workFor(ends[1], work);
  }
  ::close(ends[1]);
  std::string answer;
  const bool is_in_time = child > 0 && readAll(ends[0], seconds, answer);
  ::close(ends[0]);
  if (child < 0) throw std::runtime_error("no process can be started for it");
  if (!is_in_time) ::kill(child, SIGKILL);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!is_in_time) {
    throw std::runtime_error("no answer within " +
                             std::to_string(std::lround(std::ceil(seconds))) + " s");
  }
  if (WIFSIGNALED(status)) {
    throw std::runtime_error(std::string("it crashes (") + strsignal(WTERMSIG(status)) + ")");
  }
  if (answer.empty()) throw std::runtime_error("it ended without an answer");
  if (answer.front() == kFailed) throw std::runtime_error(answer.substr(1));
  return answer.substr(1);
}

}  // namespace afterglow::nodes
