#include "nodes/console/event_stream.hpp"

#include <utility>

namespace afterglow::nodes {

void EventStream::push(const std::string& text) {
  bool is_too_slow = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (is_closed_) return;
    is_too_slow = waiting_.size() + text.size() > kMostWaiting;
    if (!is_too_slow) waiting_ += text;
  }
  is_too_slow ? close() : wake();
}

void EventStream::close() {
  std::function<void()> on_gone;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (is_closed_) return;
    is_closed_ = true;
    waiting_.clear();
    on_gone = std::exchange(on_gone_, nullptr);
  }
  wake();
  if (on_gone) on_gone();
}

bool EventStream::isClosed() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return is_closed_;
}

void EventStream::attach(std::function<void()> wake) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    wake_ = std::move(wake);
  }
  this->wake();
}

std::string EventStream::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(waiting_, {});
}

void EventStream::wake() {
  std::function<void()> wake;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    wake = wake_;
    if (is_closed_) wake_ = nullptr;  // which holds the connection
  }
  if (wake) wake();
}

}  // namespace afterglow::nodes
