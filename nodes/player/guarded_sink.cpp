#include "nodes/player/guarded_sink.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <utility>

#include "nodes/player/watchdog.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::chrono::nanoseconds kBeat(replay::kBeatPeriod);
constexpr std::chrono::milliseconds kReadyLook(5);
constexpr double kStartPatience = 15;  // s, on a machine that is busy
constexpr double kNsPerMs = 1e6;

/// Empty if there is no such file.
std::string textOf(const char* path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

replay::SteadyTime steadyOf(std::chrono::steady_clock::time_point time) {
  return {std::chrono::nanoseconds(time.time_since_epoch()).count()};
}

}  // namespace

GuardedSink::GuardedSink(const replay::PlayPlan& plan, replay::MessageSink& sink,
                         replay::Clock& clock, std::optional<double> longest_stall_s,
                         std::function<void(const std::string&)> on_lost)
    : sink_(sink),
      on_lost_(std::move(on_lost)),
      longest_stall_s_(longest_stall_s),
      clock_(clock, [this] { beat(); }),
      watch_(plan) {
  auto process = std::make_unique<GuardProcess>();  // begins while the master is asked
  const RosGraph graph = askMaster(deadlineIn(kMasterPatience));
  const Watchdog::Listeners all{graph.subscribers, false};
  watchdogs_.emplace_back("the watchdog", std::move(process), all);
  if (RobotGuard::isThere(graph)) {
    robot_guard_ = robotGuardName();
    watchdogs_.emplace_back("the guard on the robot", std::make_unique<RobotGuard>(), all);
  }
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (topic.movesBody()) topics_.push_back(topic.output.topic);
  }
  for (const replay::MotionMonitor::Output& output : watch_.outputs()) {
    topics_.push_back(output.channel.topic);
  }
  listeners_on_ros2_ = ros2Listeners(graph, topics_);
  if (!listeners_on_ros2_.empty()) {
    robot_guard_ = ros2WatchName();
    watchdogs_.emplace_back("the watch on ROS 2", std::make_unique<RobotGuard>(robot_guard_),
                            Watchdog::Listeners{listeners_on_ros2_, true});
  }
  tellOutputs();
  ticker_ = std::thread([this] { tick(); });
}

GuardedSink::~GuardedSink() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_over_ = true;
  }
  over_.notify_all();
  ticker_.join();
  for (Watchdog& watchdog : watchdogs_) watchdog.end();
}

/// Until it is known how long the watchdogs wait, nobody sleeps on the clock: it beats itself.
void GuardedSink::tick() {
  std::unique_lock<std::mutex> lock(mutex_);
  auto next = std::chrono::steady_clock::now() + kBeat;
  while (!over_.wait_until(lock, next, [this] { return is_over_; })) {
    const auto now = std::chrono::steady_clock::now();
    pulse_.jitter.add(steadyOf(next), steadyOf(now));
    if (!pulse_.is_settled) sendBeat();
    lock.unlock();
    clock_.tick();
    lock.lock();
    while (next <= now) next += kBeat;
  }
}

// ---------------------------------------------------------------------------------- before motion

void GuardedSink::waitUntilReady(const std::function<bool()>& is_stopped) {
  const Deadline deadline = deadlineIn(kStartPatience);
  for (;;) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      listen();
      if (!lost_.empty()) throw std::runtime_error("motion is refused: " + lost_);
      if (isReady()) return;
    }
    if (is_stopped()) return;
    if (std::chrono::steady_clock::now() > deadline) {
      throw std::runtime_error("motion is refused: " + unready() + " does not get ready");
    }
    std::this_thread::sleep_for(kReadyLook);
  }
}

std::string GuardedSink::unready() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const Watchdog& watchdog : watchdogs_) {
    if (!watchdog.isReady()) return watchdog.name();
  }
  return "this machine";
}

/// Then it is also decided how long they wait.
bool GuardedSink::isReady() {
  for (const Watchdog& watchdog : watchdogs_) {
    if (!watchdog.isReady()) return false;
  }
  if (!longest_stall_s_ && !pulse_.jitter.isKnown()) return false;
  pulse_.machine = {pulse_.jitter.lateness(),
                    replay::waitingPart(textOf("/proc/pressure/cpu"), textOf("/proc/loadavg"),
                                        std::thread::hardware_concurrency())};
  if (const std::string why = replay::whyTooLate(pulse_.machine); !longest_stall_s_ && !why.empty()) {
    throw std::runtime_error("motion is refused: " + why);
  }
  pulse_.is_settled = true;
  pulse_.patience_ns = longest_stall_s_ ? std::llround(*longest_stall_s_ * 1e9)
                                        : replay::patienceBeside(pulse_.machine);
  return true;
}

std::string GuardedSink::whyUnwatched(const RosGraph& graph) const {
  for (const auto& [topic, bridges] : ros2Listeners(graph, topics_)) {
    const auto known = listeners_on_ros2_.find(topic);
    if (known != listeners_on_ros2_.end() && known->second == bridges) continue;
    return topic + " goes to ROS 2 over " + *bridges.begin() + " only now: to be asked for again";
  }
  return "";
}

replay::PlayGuards GuardedSink::guards() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  replay::PlayGuards guards;
  guards.patience_ms = static_cast<double>(pulse_.patience_ns) / kNsPerMs;
  guards.lateness_ms = static_cast<double>(pulse_.machine.woken_ns) / kNsPerMs;
  guards.waiting = pulse_.machine.waiting;
  if (watchdogs_.size() > 1) {
    const Watchdog& guard = watchdogs_.back();
    const auto patience_ns = guard.patience(pulse_.patience_ns);
    guards.on_robot = replay::PlayGuards::OnRobot{
        robot_guard_, static_cast<double>(patience_ns) / kNsPerMs,
        static_cast<double>(guard.longestGapNs()) / kNsPerMs, !guard.isBeside()};
  }
  return guards;
}

// --------------------------------------------------------------------------------------- in motion

bool GuardedSink::publish(const replay::Channel& channel, const replay::Bytes& bytes) {
  replay::MotionMonitor::Change change;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    listen();
    lookAtOwnPulse();
    change = watch_.sending(channel, bytes);
    if (change.has_other_stop) tellOutputs();
    // Before the robot is told to move, so that there is no moment in between.
    if (change.has_changed) sendBeat();
    if (change.is_motion && !lost_.empty()) throw std::runtime_error(lost_);
    has_moved_ = has_moved_ || change.is_motion;
  }
  if (change.instead) return publish(change.instead->channel, change.instead->stop);
  const bool is_heard = sink_.publish(channel, bytes);
  clock_.beatIfDue();
  return is_heard;
}

void GuardedSink::brake() {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (Watchdog& watchdog : watchdogs_) watchdog.stop();
}

void GuardedSink::goalEnded(const std::string& id) {
  replay::MotionMonitor::End end;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    lookAtOwnPulse();
    end = watch_.goalEnded(id);
    if (end.has_changed) sendBeat();
  }
  if (end.halt) publish(end.halt->channel, end.halt->stop);
}

void GuardedSink::watchGap(std::function<std::optional<double>()> gap) {
  const std::lock_guard<std::mutex> lock(mutex_);
  gap_ = std::move(gap);
}

bool GuardedSink::hasMoved() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return has_moved_;
}

void GuardedSink::beat() {
  std::string reason;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::optional<double> gap = gap_ && !watch_.moving().empty() ? gap_() : std::nullopt;
    if (gap && watch_.gapMeasured(*gap)) tellOutputs();
    listen();
    lookAtOwnPulse();
    sendBeat();
    if (lost_.empty() || std::exchange(has_told_, true)) return;
    reason = lost_;
  }
  on_lost_(reason);
}

void GuardedSink::tellOutputs() {
  for (Watchdog& watchdog : watchdogs_) watchdog.tellOutputs(watch_.outputs());
}

void GuardedSink::sendBeat() {
  pulse_.last_beat = replay::sinceBoot();
  if (!lost_.empty()) return;
  for (Watchdog& watchdog : watchdogs_) watchdog.beat(watch_.moving(), pulse_.patience_ns);
}

void GuardedSink::listen() {
  for (Watchdog& watchdog : watchdogs_) {
    watchdog.listen();
    if (!watchdog.whyLost().empty()) lose(watchdog.whyLost());
  }
}

/// Watchdogs that hung or slept as long do not know.
void GuardedSink::lookAtOwnPulse() {
  const std::int64_t gap_ns = replay::sinceBoot().ns - pulse_.last_beat.ns;
  if (pulse_.is_settled && !watch_.moving().empty() && gap_ns > pulse_.patience_ns) {
    lose(fmt::format("the player, or its machine, stood still for {:.0f} ms in motion {}",
                     static_cast<double>(gap_ns) / kNsPerMs, replay::kAllowsMore));
  }
}

/// Loses a watchdog: the other one is not enough, and stops the robot at once.
void GuardedSink::lose(const std::string& reason) {
  if (!lost_.empty()) return;
  lost_ = reason;
  for (Watchdog& watchdog : watchdogs_) watchdog.stop();
}

}  // namespace afterglow::nodes
