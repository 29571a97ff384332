#include "nodes/tools/program.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>

#include "replay/messages/text.hpp"

namespace afterglow::nodes {
namespace {

void addStream(posix_spawn_file_actions_t& actions, int from, int stream, int mode) {
  if (from == ProgramStart::kOurs) return;
  if (from == ProgramStart::kNothing) {
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", mode, 0);
  } else {
    posix_spawn_file_actions_adddup2(&actions, from, stream);
  }
}

void closeOthers(posix_spawn_file_actions_t& actions) {
#if __GLIBC_PREREQ(2, 34)
  posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
#else  // Debian 11: what another thread opens meanwhile is missed
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int number = std::stoi(entry.path().filename().string());
    if (number > STDERR_FILENO) posix_spawn_file_actions_addclose(&actions, number);
  }
#endif
}

short flagOf(ProgramStart::Leader leader) {
  switch (leader) {
    case ProgramStart::Leader::None:
      break;
    case ProgramStart::Leader::OfGroup:
      return POSIX_SPAWN_SETPGROUP;
    case ProgramStart::Leader::OfSession:
      return POSIX_SPAWN_SETSID;
  }
  return 0;
}

}  // namespace

bool hasProgram(const std::string& name) {
  if (name.find('/') != name.npos) return ::access(name.c_str(), X_OK) == 0;
  const char* path = std::getenv("PATH");
  for (const std::string& folder : replay::splitAt(':', path != nullptr ? path : "")) {
    if (::access((folder + "/" + name).c_str(), X_OK) == 0) return true;
  }
  return false;
}

pid_t startProgram(const std::vector<std::string>& arguments, const ProgramStart& start) {
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  addStream(actions, start.input, STDIN_FILENO, O_RDONLY);
  addStream(actions, start.output, STDOUT_FILENO, O_WRONLY);
  addStream(actions, start.error, STDERR_FILENO, O_WRONLY);
  closeOthers(actions);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, flagOf(start.leader));
  pid_t pid = -1;
  const int error = posix_spawnp(&pid, argv.front(), &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    throw std::system_error(error, std::generic_category(), "cannot start " + arguments.front());
  }
  return pid;
}

pid_t startProgram(const std::vector<std::string>& arguments, int output_fd) {
  ProgramStart start;
  start.output = start.error = output_fd;
  return startProgram(arguments, start);
}

int waitForProgram(pid_t pid) {
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

ProgramResult runProgram(const std::vector<std::string>& arguments) {
  return EndableProgram().run(arguments);
}

ProgramResult EndableProgram::run(const std::vector<std::string>& arguments) {
  const int fd = ::memfd_create("program output", MFD_CLOEXEC);
  if (fd < 0) throw std::runtime_error(std::string("cannot catch output: ") + std::strerror(errno));
  ProgramResult result;
  try {
    const int status = waitFor(start(arguments, fd));
    result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  } catch (...) {
    ::close(fd);
    throw;
  }
  ::lseek(fd, 0, SEEK_SET);
  std::array<char, 4096> buffer;
  for (ssize_t count; (count = ::read(fd, buffer.data(), buffer.size())) > 0;) {
    result.output.append(buffer.data(), static_cast<std::size_t>(count));
  }
  ::close(fd);
  return result;
}

pid_t EndableProgram::start(const std::vector<std::string>& arguments, int output_fd) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (is_ended_) throw std::runtime_error(arguments.front() + " is not started any more");
  pid_ = startProgram(arguments, output_fd);
  return pid_;
}

int EndableProgram::waitFor(pid_t pid) {
  siginfo_t info;
  while (::waitid(P_PID, static_cast<id_t>(pid), &info, WEXITED | WNOWAIT) < 0 && errno == EINTR) {
  }
  const std::lock_guard<std::mutex> lock(mutex_);  // its number is free for others from here on
  pid_ = 0;
  return waitForProgram(pid);
}

void EndableProgram::end() {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_ended_ = true;
  if (pid_ > 0) ::kill(pid_, SIGKILL);
}

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
    throw std::runtime_error("no answer within " + std::to_string(std::lround(std::ceil(seconds))) +
                             " s");
  }
  if (WIFSIGNALED(status)) {
    throw std::runtime_error(std::string("it crashes (") + strsignal(WTERMSIG(status)) + ")");
  }
  if (answer.empty()) throw std::runtime_error("it ended without an answer");
  if (answer.front() == kFailed) throw std::runtime_error(answer.substr(1));
  return answer.substr(1);
}

}  // namespace afterglow::nodes
