#include "nodes/console/web_socket.hpp"

#include <algorithm>
#include <utility>

namespace afterglow::nodes {

void FrameQueue::push(SocketFrame frame) {
  bool is_too_slow = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (is_closed_) return;
    is_too_slow = kept_bytes_ > 0 && kept_bytes_ + frame.bytes.size() > kMostKept;
    if (!is_too_slow) {
      kept_bytes_ += frame.bytes.size();
      waiting_.push_back({std::move(frame), false});
    }
  }
  is_too_slow ? close() : wake();
}

std::size_t FrameQueue::pushLive(std::string bytes) {
  std::size_t dropped = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (is_closed_) return 0;
    auto oldest = waiting_.begin();
    while (live_bytes_ > 0 && live_bytes_ + bytes.size() > kMostLive) {
      oldest =
          std::find_if(oldest, waiting_.end(), [](const auto& frame) { return frame.is_live; });
      live_bytes_ -= oldest->frame.bytes.size();
      oldest = waiting_.erase(oldest);
      ++dropped;
    }
    live_bytes_ += bytes.size();
    waiting_.push_back({{false, std::move(bytes)}, true});
  }
  wake();
  return dropped;
}

bool FrameQueue::hasRoom() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return kept_bytes_ < kMostAhead;
}

void FrameQueue::close() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (is_closed_) return;
    is_closed_ = true;
    waiting_.clear();
    kept_bytes_ = live_bytes_ = 0;
  }
  wake();
}

bool FrameQueue::isClosed() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return is_closed_;
}

void FrameQueue::attach(std::function<void()> wake) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    wake_ = std::move(wake);
  }
  this->wake();
}

std::optional<SocketFrame> FrameQueue::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (waiting_.empty()) return std::nullopt;
  Waiting oldest = std::move(waiting_.front());
  waiting_.pop_front();
  (oldest.is_live ? live_bytes_ : kept_bytes_) -= oldest.frame.bytes.size();
  return std::move(oldest.frame);
}

void FrameQueue::wake() {
  std::function<void()> wake;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    wake = wake_;
  }
  if (wake) wake();
}

}  // namespace afterglow::nodes
