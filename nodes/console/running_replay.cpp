#include "nodes/console/running_replay.hpp"

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
#include <utility>

#include "nodes/console/http_message.hpp"
#include "nodes/tools/program.hpp"
#include "replay/clock/steady_time.hpp"

namespace afterglow::nodes {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kTick{20};
constexpr milliseconds kAgain{100};  // between two cancels
constexpr milliseconds kBeginPatience{3000}, kEndPatience{2000};

}  // namespace

RunningReplay::RunningReplay(PlayerLink& player, Surroundings surroundings)
    : player_(player), surroundings_(std::move(surroundings)), thread_(kTick, [this] { tick(); }) {
  thread_.begin();
}

RunningReplay::~RunningReplay() { close(); }

void RunningReplay::close() {
  {
    std::unique_lock<std::mutex> lock(mutex_);
    if (is_ending_) return;
    ++stops_;  // of what is being asked for just now
    if (current_ && current_->reason.empty()) current_->reason = "the console was ended";
    changed_.wait_for(lock, kEndPatience, [this] { return !current_; });
    is_ending_ = true;
  }
  thread_.stop();
}

// ------------------------------------------------------------------------------ what is asked for

void RunningReplay::start(const Start& start) {
  const auto status = player_.status();
  if (!status) throw HttpError(503, player_.player() + " is not there");
  if (start.moves && !surroundings_.is_listening(start.session)) {
    throw HttpError(409, "who moves the robot has to listen at /api/events?session=S, and to say "
                         "the same session here: the robot is stopped when that ends");
  }
  std::string goal;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (is_ending_ || stops_ != start.after_stop) {
      throw HttpError(409, "it was stopped before it began");
    }
    if (current_ || status->state != ReplayStatus::IDLE) {
      throw HttpError(409, "a replay is under way: stop it first");
    }
    goal = player_.newGoal();
    current_ = Current();
    current_->goal = goal;
    current_->start = start;
    current_->asked = steady_clock::now();
    current_->hold.heard(replay::sinceBoot(), false);
    if (start.is_held) return;
    send();
  }
  const PlayerLink::Course course = player_.await(goal, kBeginPatience);
  const bool is_refused = course.is_ended && !course.is_completed;
  if (is_refused) throw HttpError(409, course.words.empty() ? "it was refused" : course.words);
}

/// Needs the lock held.
void RunningReplay::send() {
  surroundings_.tell_dead_man_switch(true);
  current_->is_sent = true;
  player_.send(current_->goal, current_->start.request);
}

bool RunningReplay::beat(const std::string& session) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool holds = current_ && current_->reason.empty() && current_->start.is_held &&
                     current_->start.session == session;
  if (!holds) return false;
  current_->hold.heard(replay::sinceBoot(), true);
  if (!current_->hold.isHeld(replay::sinceBoot())) return false;  // it was let go before
  if (!current_->is_sent) send();
  return true;
}

bool RunningReplay::stop(const std::string& reason) {
  bool is_heard = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++stops_;
    is_heard = player_.cancel(current_ ? current_->goal : "");
    if (current_ && current_->reason.empty()) {
      current_->reason = reason;
      current_->canceled = steady_clock::now();
      if (!current_->is_sent) {
        end(reason);
        is_heard = true;
      }
    }
  }
  stopper_.post([this] {
    try {
      player_.trigger("stop");
    } catch (const HttpError&) {  // nothing is replayed any more; the cancel is on its way anyway
    }
  });
  return is_heard;
}

std::uint64_t RunningReplay::stopCount() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return stops_;
}

void RunningReplay::needOurs() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!current_ || !current_->is_sent) {
    throw HttpError(409, "no replay that was started here is under way");
  }
}

RunningReplay::Shown RunningReplay::shown() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Shown shown;
  shown.last = last_;
  shown.reports = reports_;
  if (!current_) return shown;
  shown.is_ours = true;
  shown.waits_for_hold = !current_->is_sent;
  shown.is_stopping = !current_->reason.empty();
  shown.moves = current_->start.moves;
  shown.behavior = current_->start.request.behavior;
  return shown;
}

std::optional<RunningReplay::Report> RunningReplay::report() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return report_;
}

// -------------------------------------------------------------------------------- what is watched

void RunningReplay::tick() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Time now = steady_clock::now();
  if (!current_) return;
  const PlayerLink::Course course = player_.course(current_->goal);
  if (course.is_ended) {
    const std::string why = current_->reason.empty() ? course.words : current_->reason;
    const std::string words = course.is_completed ? "completed" : why;
    if (!course.report.empty()) {
      report_ = Report{current_->start.request.behavior, words, course.report};
      ++reports_;
    }
    return end(words);
  }
  if (current_->is_sent && !player_.isThere()) return end(player_.player() + " is gone");
  if (current_->reason.empty()) current_->reason = whyStop(now);
  if (current_->reason.empty()) return;
  if (!current_->is_sent) return end(std::string(current_->reason));
  if (now - current_->canceled < kAgain) return;
  current_->canceled = now;
  player_.cancel(current_->goal);
}

/// Needs the lock held.
std::string RunningReplay::whyStop(Time now) const {
  const Start& start = current_->start;
  if (start.is_held && current_->is_sent && !current_->hold.isHeld(replay::sinceBoot())) {
    return "the button was released";
  }
  if (start.is_held && !current_->is_sent && now - current_->asked > kHoldPatience) {
    return "nobody held the button";
  }
  const bool is_alone = start.moves && !surroundings_.is_listening(start.session);
  return is_alone ? "the page that started it is gone" : "";
}

/// Needs the lock held.
void RunningReplay::end(const std::string& words) {
  last_ = words;
  if (current_->is_sent) surroundings_.tell_dead_man_switch(false);
  current_.reset();
  changed_.notify_all();
}

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
