#include "afterglow/behavior_recording.hpp"

#include <ros/console.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace afterglow::nodes {
namespace {

using Clock = std::chrono::steady_clock;

thread_local const BehaviorRecording* innermost = nullptr;

Clock::time_point after(double seconds) {
  return Clock::now() +
         std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

/// True once the absence is logged: a robot without a recorder logs it once, not with every
/// behavior.
std::atomic<bool> absence_is_known{false};

}  // namespace

/// Shared by the recording and its requests, which may outlive it.
struct BehaviorRecording::State {
  RecordingOptions options;
  std::uint64_t serial = 0;
  std::shared_ptr<RecorderClient> recorder;
  std::shared_ptr<Requests> requests;
  Clock::time_point deadline;  ///< deadline of waiting for the start

  mutable std::mutex mutex;
  mutable std::condition_variable changed;
  bool is_started = false;  ///< or has failed
  bool has_ended = false, is_done = false;
  std::int64_t id = 0;
  std::string problem;

  bool isOverdue() const {
    const std::lock_guard<std::mutex> lock(mutex);
    return !is_started && Clock::now() > deadline;
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
  void giveUp(const std::string& why);
  void start();
  void stop(const std::string& outcome);
};

/// The requests to one recorder, which a thread makes one after the other in their order. So an
/// attempt never overlaps the one before it, and a recording ends after those within it. The thread
/// lives while there is something to ask; one that hangs ends with ROS.
class BehaviorRecording::Requests : public std::enable_shared_from_this<Requests> {
 public:
  static std::shared_ptr<Requests> to(const RecorderClient* recorder) {
    static std::mutex mutex;
    static std::map<const RecorderClient*, std::weak_ptr<Requests>> all;
    const std::lock_guard<std::mutex> lock(mutex);
    for (auto at = all.begin(); at != all.end();) at = at->second.expired() ? all.erase(at) : ++at;
    std::weak_ptr<Requests>& known = all[recorder];
    auto requests = known.lock();
    if (!requests) known = requests = std::make_shared<Requests>();
    return requests;
  }
  /// Asks for the end with this outcome; without one for the start, unless the answer to an earlier
  /// start is overdue: false.
  bool ask(const std::shared_ptr<State>& state, const std::optional<std::string>& outcome = {}) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto is_overdue = [](const Request& earlier) {
      return !earlier.outcome && earlier.state->isOverdue();
    };
    if (!outcome && std::any_of(unanswered_.begin(), unanswered_.end(), is_overdue)) return false;
    unanswered_.push_back({state, outcome});
    if (unanswered_.size() > 1) return true;
    std::thread([self = shared_from_this()] { self->run(); }).detach();
    return true;
  }

 private:
  struct Request {
    std::shared_ptr<State> state;
    std::optional<std::string> outcome;
  };

  void run() {
    std::unique_lock<std::mutex> lock(mutex_);
    for (; !unanswered_.empty(); unanswered_.pop_front()) {
      const Request request = unanswered_.front();
      lock.unlock();
      request.outcome ? request.state->stop(*request.outcome) : request.state->start();
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::deque<Request> unanswered_;
};

void BehaviorRecording::State::giveUp(const std::string& why) {
  set([&] {
    problem = why;
    is_started = is_done = true;
  });
}

void BehaviorRecording::State::start() {
  try {
    const std::int64_t begun = recorder->start(options);
    absence_is_known = false;
    set([&] {
      id = begun;
      is_started = true;
    });
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
}

void BehaviorRecording::State::stop(const std::string& outcome) {
  if (is_done) return;  // it has no recording
  std::string trouble;
  try {
    recorder->stop(id, outcome);
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
  static std::atomic<std::uint64_t> count{0};
  if (options.tree_path.empty()) {
    options.tree_path = (innermost ? innermost->treePath() + "/" : "") + options.name;
  }
  state_->options = std::move(options);
  state_->recorder = std::move(recorder);
  state_->requests = Requests::to(state_->recorder.get());
  state_->deadline = after(state_->options.timeout_s);
  state_->serial = ++count;
  if (!state_->requests->ask(state_)) state_->giveUp("the recorder does not answer");
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
    exceptions_ = other.exceptions_;
  }
  return *this;
}

void BehaviorRecording::end(const std::string& outcome) {
  bool is_asked = false;
  state_->set([&] { is_asked = !std::exchange(state_->has_ended, true) && !state_->is_done; });
  if (is_asked) state_->requests->ask(state_, outcome);
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
  if (!state_->wait(after(state_->options.timeout_s), [this] { return state_->is_done; })) {
    ROS_WARN_STREAM("the recorder does not answer; '" << state_->options.name
                                                      << "' goes on without it");
  }
}

EnclosingRecording::EnclosingRecording(const BehaviorRecording& recording)
    : outer_(std::exchange(innermost, &recording)) {}

EnclosingRecording::~EnclosingRecording() { innermost = outer_; }

std::uint64_t EnclosingRecording::current() { return innermost ? innermost->serial() : 0; }

}  // namespace afterglow::nodes
