#include "nodes/player/guarded_sink.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::chrono::nanoseconds kBeat(replay::kBeatPeriod);
constexpr std::chrono::milliseconds kReadyLook(5);
constexpr double kStartPatience = 15;  // s, on a machine that is busy
constexpr double kNsPerMs = 1e6;

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
  const RosGraph graph = askMaster(deadlineIn(kMasterPatience));
  if (RobotGuard::isThere(graph)) robot_guard_.emplace(graph);
  for (Watchdog* watchdog : watchdogs()) watchdog->tellOutputs(watch_.outputs());
  ticker_ = std::thread([this] { tick(); });
}

GuardedSink::~GuardedSink() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_over_ = true;
  }
  over_.notify_all();
  ticker_.join();
  for (Watchdog* watchdog : watchdogs()) watchdog->end();
}

std::vector<Watchdog*> GuardedSink::watchdogs() {
  std::vector<Watchdog*> all{&process_};
  if (robot_guard_) all.push_back(&*robot_guard_);
  return all;
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
      throw std::runtime_error("motion is refused: the watchdog does not get ready");
    }
    std::this_thread::sleep_for(kReadyLook);
  }
}

/// Then it is also decided how long they wait.
bool GuardedSink::isReady() {
  for (Watchdog* watchdog : watchdogs()) {
    if (!watchdog->isReady()) return false;
  }
  if (!longest_stall_s_ && !pulse_.jitter.isKnown()) return false;
  pulse_.is_settled = true;
  pulse_.patience_ns = longest_stall_s_ ? std::llround(*longest_stall_s_ * 1e9)
                                        : replay::patienceBeside(pulse_.jitter.lateness());
  return true;
}

replay::PlayGuards GuardedSink::guards() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  replay::PlayGuards guards;
  guards.patience_ms = static_cast<double>(pulse_.patience_ns) / kNsPerMs;
  guards.lateness_ms = static_cast<double>(pulse_.jitter.lateness()) / kNsPerMs;
  if (robot_guard_) {
    const auto patience_ns = robot_guard_->patience(pulse_.patience_ns);
    guards.on_robot = replay::PlayGuards::OnRobot{
        robotGuardName(), static_cast<double>(patience_ns) / kNsPerMs,
        static_cast<double>(robot_guard_->longestGapNs()) / kNsPerMs, !robot_guard_->isBeside()};
  }
  return guards;
}

// --------------------------------------------------------------------------------------- in motion

bool GuardedSink::publish(const replay::Channel& channel, const replay::Bytes& bytes) {
  replay::MotionWatch::Change change;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    listen();
    lookAtOwnPulse();
    change = watch_.sending(channel, bytes);
    if (change.has_other_stop) tellOutput(change.output);
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
  for (Watchdog* watchdog : watchdogs()) watchdog->stop();
}

void GuardedSink::goalEnded(const std::string& id) {
  replay::MotionWatch::End end;
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
    if (gap) {
      for (const std::uint32_t output : watch_.gapMeasured(*gap)) tellOutput(output);
    }
    listen();
    lookAtOwnPulse();
    sendBeat();
    if (lost_.empty() || std::exchange(has_told_, true)) return;
    reason = lost_;
  }
  on_lost_(reason);
}

void GuardedSink::tellOutput(std::uint32_t output) {
  for (Watchdog* watchdog : watchdogs()) watchdog->tellOutput(watch_.outputs(), output);
}

void GuardedSink::sendBeat() {
  pulse_.last_beat = replay::sinceBoot();
  if (!lost_.empty()) return;
  for (Watchdog* watchdog : watchdogs()) watchdog->beat(watch_.moving(), pulse_.patience_ns);
}

void GuardedSink::listen() {
  for (Watchdog* watchdog : watchdogs()) {
    watchdog->listen();
    if (!watchdog->whyLost().empty()) lose(watchdog->whyLost());
  }
}

/// Watchdogs that hung or slept as long do not know.
void GuardedSink::lookAtOwnPulse() {
  const std::int64_t gap_ns = replay::sinceBoot().ns - pulse_.last_beat.ns;
  if (pulse_.is_settled && !watch_.moving().empty() && gap_ns > pulse_.patience_ns) {
    lose(fmt::format("the player, or its machine, stood still for {:.0f} ms in motion",
                     static_cast<double>(gap_ns) / kNsPerMs));
  }
}

/// One of the watchdogs is not enough: the others stop the robot at once.
void GuardedSink::lose(const std::string& reason) {
  if (!lost_.empty()) return;
  lost_ = reason;
  for (Watchdog* watchdog : watchdogs()) watchdog->stop();
}

}  // namespace afterglow::nodes
