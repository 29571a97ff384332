#include "nodes/player/guard_process.hpp"

#include <ros/ros.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "nodes/tools/program.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

using nlohmann::json;

constexpr const char* kProgram = "afterglow_replay_guard";
constexpr double kEndPatience = 2;  // s
/// Beats without an answer: the watchdog hangs.
constexpr int kMostUnanswered = 25;

}  // namespace

std::string guardName() { return ros::this_node::getName() + "_guard"; }

GuardProcess::GuardProcess() : GuardProcess(GuardLink::makePair()) {}

GuardProcess::GuardProcess(const std::pair<int, int>& ends) : link_(ends.first) {
  const GuardLink other(ends.second);
  start(ends.second);
}

void GuardProcess::start(int its_end) {
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe");
  ProgramStart start;
  start.input = its_end;
  start.output = start.error = ProgramStart::kOurs;
  // Ctrl-C and the end of a terminal are the player's.
  start.leader = ProgramStart::Leader::OfSession;
  const std::string program = own.parent_path() / kProgram;
  try {
    pid_ = startProgram({program, guardName()}, start);
  } catch (const std::system_error& error) {
    throw std::runtime_error("motion is refused: the watchdog " + program +
                             " cannot be started: " + error.code().message());
  }
}

GuardProcess::~GuardProcess() {
  end();
  const Deadline deadline = deadlineIn(kEndPatience);
  while (::waitpid(pid_, nullptr, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() > deadline) ::kill(pid_, SIGKILL);
    ::usleep(5000);
  }
}

void GuardProcess::tellOutputs(const std::vector<replay::MotionWatch::Output>& outputs) {
  for (std::uint32_t output = 0; output < outputs.size(); ++output) tellOutput(outputs, output);
  send({{"kind", "ready?"}});
}

void GuardProcess::tellOutput(const std::vector<replay::MotionWatch::Output>& outputs,
                              std::uint32_t changed) {
  const auto& [channel, stop, may_be_unheard] = outputs[changed];
  send({{"kind", "output"},
        {"index", changed},
        {"topic", channel.topic},
        {"type", channel.type},
        {"md5", channel.md5},
        {"definition", channel.definition},
        {"stop", json::binary(stop)},
        {"may_be_unheard", may_be_unheard}});
}

void GuardProcess::beat(const replay::Outputs& moving, std::int64_t patience_ns) {
  if (!is_ready_) return;  // it is busy getting there
  send({{"kind", "beat"},
        {"moving", moving},
        {"patience_ns", patience_ns},
        {"sent_ns", replay::sinceBoot().ns}});
  if (++unanswered_ > kMostUnanswered) lose("the watchdog does not answer");
}

void GuardProcess::stop() { send({{"kind", "stop"}}); }

void GuardProcess::end() { send({{"kind", "end"}}); }

void GuardProcess::send(const json& message) {
  if (!link_.send(message)) lose("the watchdog is gone");
}

void GuardProcess::listen() {
  while (const auto message = link_.receive()) {
    const std::string kind = message->at("kind");
    if (kind == "ready") {
      is_ready_ = true;
    } else if (kind == "beat") {
      unanswered_ = 0;
    } else if (kind == "braking") {
      lose("the watchdog stopped the robot: " + message->at("reason").get<std::string>());
    }
  }
  if (link_.isClosed()) lose("the watchdog is gone");
}

void GuardProcess::lose(const std::string& reason) {
  if (lost_.empty()) lost_ = reason;
}

}  // namespace afterglow::nodes
