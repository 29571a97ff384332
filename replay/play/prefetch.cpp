#include "replay/play/prefetch.hpp"

#include <utility>

namespace afterglow::replay {
namespace {

std::size_t sizeOf(const Message& message) { return message.bytes.size() + sizeof(Message); }

}  // namespace

Prefetch::Prefetch(std::unique_ptr<MessageCursor> cursor, std::size_t bytes)
    : cursor_(std::move(cursor)), bytes_(bytes), reader_([this] { readLoop(); }) {}

Prefetch::~Prefetch() { end(); }

void Prefetch::fill() {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [this] { return isFull() || has_ended_ || is_canceled_; });
}

const Message* Prefetch::front() {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [this] { return !queue_.empty() || has_ended_ || is_canceled_; });
  if (is_canceled_) {
    return nullptr;
  }
  if (!queue_.empty()) {
    return &queue_.front();
  }
  if (problem_) {
    std::rethrow_exception(problem_);
  }
  return nullptr;
}

const Message* Prefetch::ready() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return queue_.empty() ? nullptr : &queue_.front();
}

Message Prefetch::pop() {
  Message message;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    message = std::move(queue_.front());
    queue_.pop_front();
    held_bytes_ -= sizeOf(message);
  }
  changed_.notify_all();
  return message;
}

void Prefetch::cancel() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_canceled_ = true;
  }
  changed_.notify_all();
}

std::vector<DamagedMessage> Prefetch::end() {
  cancel();
  if (reader_.joinable()) reader_.join();
  return cursor_->damaged();
}

void Prefetch::readLoop() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!has_ended_ && !is_canceled_) {
    changed_.wait(lock, [this] { return !isFull() || is_canceled_; });
    lock.unlock();
    std::optional<Message> message;
    std::exception_ptr problem;
    try {
      message = cursor_->next();
    } catch (...) {
      problem = std::current_exception();
    }
    lock.lock();
    if (message) {
      held_bytes_ += sizeOf(*message);
      queue_.push_back(std::move(*message));
    } else {
      problem_ = problem;
      has_ended_ = true;
    }
    changed_.notify_all();
  }
}

}  // namespace afterglow::replay
