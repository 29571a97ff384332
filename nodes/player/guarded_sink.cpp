#include "nodes/player/guarded_sink.hpp"

#include <ros/ros.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include "nodes/tools/program.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

using nlohmann::json;

constexpr const char* kProgram = "afterglow_replay_guard";
constexpr std::chrono::milliseconds kBeat(20);
constexpr double kStartPatience = 15;  // s, on a machine that is busy
constexpr double kEndPatience = 2;     // s
/// Beats without an answer: the watchdog hangs.
constexpr int kMostUnanswered = 25;

}  // namespace

std::string guardName() { return ros::this_node::getName() + "_guard"; }

GuardedSink::GuardedSink(const replay::PlayPlan& plan, replay::MessageSink& sink,
                         replay::Clock& clock, double longest_stall_s,
                         std::function<void(const std::string&)> on_lost)
    : sink_(sink), on_lost_(std::move(on_lost)), clock_(clock, [this] { beat(); }), watch_(plan) {
  start(longest_stall_s);
  for (std::uint32_t output = 0; output < watch_.outputs().size(); ++output) tellOutput(output);
  send({{"kind", "ready?"}});
  ticker_ = std::thread([this] { tick(); });
}

void GuardedSink::start(double longest_stall_s) {
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe");
  const auto [mine, its] = GuardLink::makePair();
  link_ = std::make_unique<GuardLink>(mine);
  const GuardLink other(its);
  ProgramStart start;
  start.input = its;
  start.output = start.error = ProgramStart::kOurs;
  // Ctrl-C and the end of a terminal are the player's.
  start.leader = ProgramStart::Leader::OfSession;
  const std::string program = own.parent_path() / kProgram;
  try {
    pid_ = startProgram(
        {program, guardName(), std::to_string(std::llround(longest_stall_s * 1000))}, start);
  } catch (const std::system_error& error) {
    throw std::runtime_error("motion is refused: the watchdog " + program +
                             " cannot be started: " + error.code().message());
  }
}

GuardedSink::~GuardedSink() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_over_ = true;
  }
  over_.notify_all();
  ticker_.join();
  link_->send({{"kind", "end"}});
  const Deadline deadline = deadlineIn(kEndPatience);
  while (::waitpid(pid_, nullptr, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() > deadline) ::kill(pid_, SIGKILL);
    ::usleep(5000);
  }
}

void GuardedSink::tick() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!over_.wait_for(lock, kBeat, [this] { return is_over_; })) {
    lock.unlock();
    clock_.tick();
    lock.lock();
  }
}

void GuardedSink::waitUntilReady(const std::function<bool()>& is_stopped) {
  const Deadline deadline = deadlineIn(kStartPatience);
  for (;;) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      listen();
      if (!lost_.empty()) throw std::runtime_error("motion is refused: " + lost_);
      if (is_ready_) return;
    }
    if (is_stopped()) return;
    if (std::chrono::steady_clock::now() > deadline) {
      throw std::runtime_error("motion is refused: the watchdog does not get ready");
    }
    link_->wait(20);
  }
}

bool GuardedSink::publish(const replay::Channel& channel, const replay::Bytes& bytes) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const replay::MotionWatch::Change change = watch_.sending(channel, bytes);
    listen();
    if (change.has_other_stop) tellOutput(change.output);
    // Before the robot is told to move, so that there is no moment in between.
    if (change.has_changed) send({{"kind", "beat"}, {"moving", watch_.moving()}});
    if (change.is_motion && !lost_.empty()) throw std::runtime_error(lost_);
  }
  const bool is_heard = sink_.publish(channel, bytes);
  clock_.beatIfDue();
  return is_heard;
}

void GuardedSink::brake() {
  const std::lock_guard<std::mutex> lock(mutex_);
  send({{"kind", "stop"}});
}

void GuardedSink::goalEnded(const std::string& id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (watch_.goalEnded(id)) send({{"kind", "beat"}, {"moving", watch_.moving()}});
}

void GuardedSink::tellOutput(std::uint32_t output) {
  const auto& [channel, stop] = watch_.outputs()[output];
  send({{"kind", "output"},
        {"index", output},
        {"topic", channel.topic},
        {"type", channel.type},
        {"md5", channel.md5},
        {"definition", channel.definition},
        {"stop", json::binary(stop)}});
}

void GuardedSink::beat() {
  std::string reason;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    send({{"kind", "beat"}, {"moving", watch_.moving()}});
    listen();
    if (lost_.empty() || std::exchange(has_told_, true)) return;
    reason = lost_;
  }
  on_lost_(reason);
}

void GuardedSink::send(const json& message) {
  if (!lost_.empty()) {
    return;
  }
  unanswered_ += message.at("kind") == "beat";
  if (!link_->send(message)) lose("the watchdog is gone");
  if (unanswered_ > kMostUnanswered) lose("the watchdog does not answer");
}

void GuardedSink::listen() {
  while (const auto message = link_->receive()) {
    const std::string kind = message->at("kind");
    if (kind == "ready") {
      is_ready_ = true;
    } else if (kind == "beat") {
      unanswered_ = 0;
    } else if (kind == "braking") {
      lose("the watchdog stopped the robot: " + message->at("reason").get<std::string>());
    }
  }
  if (link_->isClosed()) lose("the watchdog is gone");
}

void GuardedSink::lose(const std::string& reason) {
  if (lost_.empty()) lost_ = reason;
}

}  // namespace afterglow::nodes
