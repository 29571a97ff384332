#include "afterglow/behavior_recording.hpp"

#include <ros/console.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

namespace afterglow::nodes {
namespace {

using Clock = std::chrono::steady_clock;

thread_local const BehaviorRecording* innermost = nullptr;

Clock::time_point after(double seconds) {
  return Clock::now() +
         std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

/// On a robot without a recorder this is logged once, not with every behavior.
std::atomic<bool> absence_is_known{false};

}  // namespace

/// Shared by the recording and its thread, which may outlive it.
struct BehaviorRecording::State {
  RecordingOptions options;
  std::uint64_t serial = 0;
  std::shared_ptr<RecorderClient> recorder;
  Clock::time_point deadline;        ///< of waiting for the start
  States before_start, before_stop;  ///< recordings that have to be answered before this

  mutable std::mutex mutex;
  mutable std::condition_variable changed;
  bool is_started = false;  ///< or has failed
  bool is_done = false;
  std::int64_t id = 0;
  std::string problem;
  std::optional<std::string> outcome;

  bool isOverdue() const {
    const std::lock_guard<std::mutex> lock(mutex);
    return !is_started && Clock::now() > deadline;
  }
  /// Under the mutex.
  bool isAnswered() const { return is_started && (!outcome || is_done); }
  bool isBusy() const {
    const std::lock_guard<std::mutex> lock(mutex);
    return !isAnswered();
  }
  /// Changes members and wakes waiting threads.
  template <typename Change>
  void set(const Change& change) {
    const std::lock_guard<std::mutex> lock(mutex);
    change();
    changed.notify_all();
  }
  /// Waits for a condition, evaluated under the mutex. False if it does not hold in time.
  template <typename Condition>
  bool wait(Clock::time_point until, const Condition& condition) const {
    std::unique_lock<std::mutex> lock(mutex);
    return changed.wait_until(lock, until, condition);
  }
  bool isBelow(const std::string& path) const {
    return options.tree_path.compare(0, path.size() + 1, path + "/") == 0;
  }
  static void awaitAnswers(States& others, Clock::time_point until);
  void giveUp(const std::string& why);
  bool start();
  void run();
};

/// All recordings of this process.
class BehaviorRecording::Registry {
 public:
  static Registry& instance() {
    static Registry registry;
    return registry;
  }
  std::uint64_t add(const std::shared_ptr<State>& state) {
    const std::lock_guard<std::mutex> lock(mutex_);
    all_.push_back(state);
    return ++count_;
  }
  /// The other recordings that wait for an answer of the same recorder.
  States busy(const State& state) {
    const std::lock_guard<std::mutex> lock(mutex_);
    States busy;
    const auto is_gone = [&](const std::weak_ptr<State>& entry) {
      const std::shared_ptr<State> other = entry.lock();
      if (other && other.get() != &state && other->recorder == state.recorder && other->isBusy()) {
        busy.push_back(other);
      }
      return !other;
    };
    all_.erase(std::remove_if(all_.begin(), all_.end(), is_gone), all_.end());
    return busy;
  }

 private:
  std::mutex mutex_;
  std::vector<std::weak_ptr<State>> all_;
  std::uint64_t count_ = 0;
};

void BehaviorRecording::State::awaitAnswers(States& others, Clock::time_point until) {
  for (const auto& other : std::exchange(others, {})) {
    other->wait(until, [&other] { return other->isAnswered(); });
  }
}

void BehaviorRecording::State::giveUp(const std::string& why) {
  set([&] {
    problem = why;
    is_started = is_done = true;
  });
}

bool BehaviorRecording::State::start() {
  try {
    const std::int64_t begun = recorder->start(options);
    absence_is_known = false;
    set([&] {
      id = begun;
      is_started = true;
    });
    return true;
  } catch (const RecorderAbsent& error) {
    if (!absence_is_known.exchange(true)) {
      ROS_WARN_STREAM(error.what() << "; '" << options.name
                                   << "' and what follows goes unrecorded until there is one");
    }
    giveUp(error.what());
  } catch (const std::exception& error) {
    ROS_WARN_STREAM("'" << options.name << "' goes unrecorded: " << error.what());
    giveUp(error.what());
  }
  return false;
}

void BehaviorRecording::State::run() {
  awaitAnswers(before_start, deadline);
  if (!start()) {
    return;
  }
  std::string word;
  {
    std::unique_lock<std::mutex> lock(mutex);
    changed.wait(lock, [this] { return outcome.has_value(); });
    word = *outcome;
  }
  awaitAnswers(before_stop, after(options.timeout_s));
  std::string trouble;
  try {
    recorder->stop(id, word);
  } catch (const std::exception& error) {
    ROS_WARN_STREAM("the end of '" << options.name << "': " << error.what());
    trouble = error.what();
  }
  set([&] {
    problem = trouble;
    is_done = true;
  });
}

BehaviorRecording::BehaviorRecording(RecordingOptions options,
                                     std::shared_ptr<RecorderClient> recorder)
    : state_(std::make_shared<State>()), exceptions_(std::uncaught_exceptions()) {
  if (options.tree_path.empty()) {
    options.tree_path = (innermost ? innermost->treePath() + "/" : "") + options.name;
  }
  state_->options = std::move(options);
  state_->recorder = std::move(recorder);
  state_->deadline = after(state_->options.timeout_s);
  state_->before_start = Registry::instance().busy(*state_);
  state_->serial = Registry::instance().add(state_);
  const auto is_overdue = [](const auto& other) { return other->isOverdue(); };
  if (std::any_of(state_->before_start.begin(), state_->before_start.end(), is_overdue)) {
    state_->before_start.clear();
    state_->giveUp("the recorder does not answer");
  } else {
    thread_ = std::thread([state = state_] { state->run(); });
  }
  if (!state_->options.wait) {
    return;
  }
  state_->wait(state_->deadline, [this] { return state_->is_started; });
  const std::string trouble = problem();
  if (!trouble.empty() && state_->options.required) {
    end("unrecorded");
    finish();
    throw std::runtime_error("'" + state_->options.name + "' cannot be recorded: " + trouble);
  }
}

BehaviorRecording::~BehaviorRecording() { finish(); }

BehaviorRecording& BehaviorRecording::operator=(BehaviorRecording&& other) noexcept {
  if (this != &other) {
    finish();
    state_ = std::move(other.state_);
    thread_ = std::move(other.thread_);
    exceptions_ = other.exceptions_;
  }
  return *this;
}

void BehaviorRecording::end(const std::string& outcome) {
  // Recordings below this one are started and stopped before this one is stopped.
  States below = Registry::instance().busy(*state_);
  const auto is_elsewhere = [this](const auto& other) { return !other->isBelow(treePath()); };
  below.erase(std::remove_if(below.begin(), below.end(), is_elsewhere), below.end());
  state_->set([&] {
    if (!state_->outcome) {
      state_->outcome = outcome;
      state_->before_stop = std::move(below);
    }
  });
}

bool BehaviorRecording::isSettled() const {
  const std::lock_guard<std::mutex> lock(state_->mutex);
  return state_->is_started || Clock::now() >= state_->deadline;
}

bool BehaviorRecording::isDone() const {
  const std::lock_guard<std::mutex> lock(state_->mutex);
  return state_->is_done;
}

std::int64_t BehaviorRecording::id() const {
  const std::lock_guard<std::mutex> lock(state_->mutex);
  return state_->id;
}

std::string BehaviorRecording::problem() const {
  const std::lock_guard<std::mutex> lock(state_->mutex);
  return state_->is_started || Clock::now() < state_->deadline ? state_->problem
                                                               : "the recorder does not answer";
}

const std::string& BehaviorRecording::treePath() const { return state_->options.tree_path; }

std::uint64_t BehaviorRecording::serial() const { return state_->serial; }

void BehaviorRecording::finish() noexcept {
  if (!state_) {
    return;  // moved from
  }
  end(std::uncaught_exceptions() > exceptions_ ? "exception" : "stopped");
  if (!thread_.joinable()) {
    return;
  }
  if (state_->wait(after(state_->options.timeout_s), [this] { return state_->is_done; })) {
    thread_.join();
  } else {
    ROS_WARN_STREAM("the recorder does not answer; '" << state_->options.name
                                                      << "' goes on without it");
    thread_.detach();  // ends when the recorder answers, or with ROS
  }
}

EnclosingRecording::EnclosingRecording(const BehaviorRecording& recording)
    : outer_(std::exchange(innermost, &recording)) {}

EnclosingRecording::~EnclosingRecording() { innermost = outer_; }

std::uint64_t EnclosingRecording::current() { return innermost ? innermost->serial() : 0; }

}  // namespace afterglow::nodes
