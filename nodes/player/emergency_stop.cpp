#include "nodes/player/emergency_stop.hpp"

#include <stdexcept>
#include <thread>
#include <utility>

namespace afterglow::nodes {
namespace {

constexpr double kFirstWord = 2.0;  // s, for a latched word

}  // namespace

EmergencyStop::EmergencyStop(const EmergencyStopOptions& options,
                             std::function<void(const std::string&)> on_stop)
    : options_(options), on_stop_(std::move(on_stop)), spinner_(1, &queue_) {
  node_.setCallbackQueue(&queue_);
  subscriber_ = node_.subscribe<std_msgs::Bool>(
      options_.topic, 10, [this](const auto& message) { onWord(message->data != 0); });
  if (options_.longest_silence_s > 0) {
    timer_ = node_.createWallTimer(ros::WallDuration(options_.longest_silence_s / 4),
                                   [this](const auto&) { onTimer(); });
  }
  spinner_.start();
}

EmergencyStop::~EmergencyStop() {
  subscriber_.shutdown();
  timer_.stop();
  spinner_.stop();
}

void EmergencyStop::check() {
  const bool is_published =
      !askMaster(deadlineIn(kMasterPatience)).otherPublishers(subscriber_.getTopic()).empty();
  const Deadline deadline = deadlineIn(kFirstWord);
  bool waits = is_published || options_.longest_silence_s > 0;
  while (waits && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const std::lock_guard<std::mutex> lock(mutex_);
    waits = !heard_;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (is_pressed_) {
    throw std::runtime_error("motion is refused: the emergency stop is pressed (" + options_.topic +
                             ")");
  }
  if (waits) {
    throw std::runtime_error("motion is refused: nothing is heard of the emergency stop on " +
                             options_.topic);
  }
  is_checked_ = true;
}

void EmergencyStop::onWord(bool is_pressed) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    heard_ = std::chrono::steady_clock::now();
    is_pressed_ = is_pressed;
  }
  if (is_pressed) stop("the emergency stop was pressed (" + options_.topic + ")");
}

void EmergencyStop::onTimer() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::chrono::duration<double> longest(options_.longest_silence_s);
    if (!is_checked_ || std::chrono::steady_clock::now() - *heard_ <= longest) return;
  }
  stop("the emergency stop is silent (" + options_.topic + ")");
}

void EmergencyStop::stop(const std::string& reason) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (std::exchange(has_stopped_, true)) return;
  }
  on_stop_(reason);
}

}  // namespace afterglow::nodes
