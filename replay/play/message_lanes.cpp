#include "replay/play/message_lanes.hpp"

#include <cmath>
#include <map>
#include <string>
#include <tuple>
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

std::int64_t earlyNs(double latency_s, double rate) { return std::llround(latency_s * rate * 1e9); }

MessageLanes::MessageLanes(const Store& store, const PlayPlan& plan, const ModalityLatency& latency,
                           Stamp begin, std::size_t bytes) {
  std::map<double, std::vector<std::string>> topics;
  for (const PlannedTopic& topic : plan.topics) {
    if (topic.isPlayed()) {
      topics[latencyOf(latency, topic.modality)].push_back(topic.channel.topic);
    }
  }
  for (const auto& [seconds, names] : topics) {
    lanes_.push_back({seconds, std::make_unique<Prefetch>(
                                   store.messages(plan.behavior, {names, begin, plan.end}),
                                   bytes / topics.size())});
  }
}

std::optional<MessageLanes::Next> MessageLanes::front(double rate, std::optional<Stamp> limit) {
  return next(rate, limit, &Prefetch::front);
}

std::optional<MessageLanes::Next> MessageLanes::ready(double rate, std::optional<Stamp> limit) {
  return next(rate, limit, &Prefetch::ready);
}

std::optional<MessageLanes::Next> MessageLanes::next(double rate, std::optional<Stamp> limit,
                                                     const Message* (Prefetch::*look)()) {
  const auto order = [&](const Next& next) {
    const Stamp received = next.message->received;
    return std::make_tuple(limit && received > *limit, next.due().ns, received.ns,
                           next.message->sequence);
  };
  std::optional<Next> first;
  for (const Lane& lane : lanes_) {
    if (const Message* message = (*lane.messages.*look)()) {
      const Next found{message, earlyNs(lane.latency_s, rate), lane.messages.get()};
      if (!first || order(found) < order(*first)) first = found;
    }
  }
  return first;
}

void MessageLanes::fill() {
  for (const Lane& lane : lanes_) lane.messages->fill();
}

void MessageLanes::cancel() {
  for (const Lane& lane : lanes_) lane.messages->cancel();
}

std::vector<DamagedMessage> MessageLanes::end() {
  std::vector<DamagedMessage> damaged;
  for (const Lane& lane : lanes_) {
    const std::vector<DamagedMessage> of_lane = lane.messages->end();
    damaged.insert(damaged.end(), of_lane.begin(), of_lane.end());
  }
  return damaged;
}

}  // namespace afterglow::replay
