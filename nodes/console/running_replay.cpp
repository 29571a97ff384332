#include "nodes/console/running_replay.hpp"

#include <utility>

#include "nodes/console/http_message.hpp"
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

}  // namespace afterglow::nodes
