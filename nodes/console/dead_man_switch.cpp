#include "nodes/console/dead_man_switch.hpp"

#include <fcntl.h>
#include <ros/ros.h>
#include <std_srvs/Trigger.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "nodes/tools/program.hpp"

namespace afterglow::nodes {
namespace {

constexpr char kRuns = 'r', kRests = '-';
constexpr int kTimes = 10;  // a goal that was sent last may begin a little later
constexpr double kBetween = 0.1;  // s

}  // namespace

DeadManSwitch::DeadManSwitch(const std::string& player) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw std::runtime_error(std::string("no pipe: ") + std::strerror(errno));
  }
  pipe_ = ends[1];
  ProgramStart start;
  start.input = ends[0];
  start.error = ProgramStart::kOurs;
  start.leader = ProgramStart::Leader::OfSession;  // Ctrl-C is the console's
  const std::string own = std::filesystem::read_symlink("/proc/self/exe");
  try {
    pid_ = startProgram({own, kArgument, player}, start);
  } catch (...) {
    ::close(ends[0]);
    ::close(ends[1]);
    throw;
  }
  ::close(ends[0]);
}

DeadManSwitch::~DeadManSwitch() {
  ::close(pipe_);
  if (pid_ > 0) ::waitpid(pid_, nullptr, 0);
}

void DeadManSwitch::tell(bool runs) const {
  const char word = runs ? kRuns : kRests;
  while (::write(pipe_, &word, 1) < 0 && errno == EINTR) {
  }
}

bool DeadManSwitch::isThere() const {
  if (pid_ > 0 && ::waitpid(pid_, nullptr, WNOHANG) != 0) pid_ = -1;
  return pid_ > 0;
}

int runDeadManSwitch(const std::string& player) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_IGN);
  char word = kRests, newest = kRests;
  for (;;) {
    const ssize_t count = ::read(STDIN_FILENO, &word, 1);
    if (count == 1) newest = word;
    if (count == 0 || (count < 0 && errno != EINTR)) break;
  }
  if (newest != kRuns) return 0;
  const std::map<std::string, std::string> none;
  ros::init(none, "console_dead_man_switch",
            ros::init_options::NoSigintHandler | ros::init_options::AnonymousName |
                ros::init_options::NoRosout);
  ros::start();
  bool was_heard = false;
  for (int i = 0; i < kTimes; ++i) {
    std_srvs::Trigger stop;
    was_heard = ros::service::call(player + "/stop", stop) || was_heard;
    ros::WallDuration(kBetween).sleep();
  }
  return was_heard ? 0 : 1;
}

}  // namespace afterglow::nodes
