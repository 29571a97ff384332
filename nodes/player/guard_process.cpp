#include "nodes/player/guard_process.hpp"

#include <ros/ros.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <system_error>

#include "nodes/tools/program.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/plan/refusal_text.hpp"

namespace afterglow::nodes {
namespace {

constexpr const char* kProgram = "afterglow_replay_guard";
constexpr double kEndPatience = 2;  // s

}  // namespace

std::string guardName() { return ros::this_node::getName() + "_guard"; }

GuardProcess::GuardProcess() {
  const auto [ours, its] = GuardSocket::makePair();
  socket_.emplace(ours);
  const GuardSocket other(its);
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe");
  ProgramStart start;
  start.input = its;
  start.output = start.error = ProgramStart::kOurs;
  // Ctrl-C and the end of a terminal are the player's.
  start.leader = ProgramStart::Leader::OfSession;
  const std::string program = own.parent_path() / kProgram;
  try {
    pid_ = startProgram({program, guardName()}, start);
  } catch (const std::system_error& error) {
    throw replay::MotionRefused("the watchdog " + program +
                                " cannot be started: " + error.code().message());
  }
}

GuardProcess::~GuardProcess() {
  socket_.reset();
  const Deadline deadline = deadlineIn(kEndPatience);
  while (::waitpid(pid_, nullptr, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() > deadline) ::kill(pid_, SIGKILL);
    ::usleep(5000);
  }
}

GuardAnswer GuardProcess::answer() {
  for (GuardSocket::Packet packet; !(packet = socket_->receive()).empty();) {
    GuardSocket::read(packet, answer_);
  }
  return answer_;
}

}  // namespace afterglow::nodes
