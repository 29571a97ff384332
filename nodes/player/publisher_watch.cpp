#include "nodes/player/publisher_watch.hpp"

#include <chrono>
#include <utility>
#include <vector>

namespace afterglow::nodes {
namespace {

constexpr std::chrono::milliseconds kAskingPeriod(250);
constexpr double kNodeAnswer = 0.5;  // s, for one answer of a node on a busy machine
constexpr int kMostUnheeded = 1;

}  // namespace

PublisherWatch::PublisherWatch(std::function<void(const std::string&)> on_gone)
    : on_gone_(std::move(on_gone)), thread_([this] { run(); }) {}

PublisherWatch::~PublisherWatch() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_over_ = true;
  }
  over_.notify_all();
  thread_.join();
}

void PublisherWatch::add(const std::string& node) {
  const std::lock_guard<std::mutex> lock(mutex_);
  nodes_.try_emplace(node);
}

void PublisherWatch::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!over_.wait_for(lock, kAskingPeriod, [this] { return is_over_; })) {
    std::vector<std::string> names;
    for (const auto& [node, known] : nodes_) names.push_back(node);
    lock.unlock();
    for (const std::string& node : names) {
      if (!isGone(node)) continue;
      on_gone_(node);
      return;
    }
    lock.lock();
  }
}

/// Asks without the lock, which callbacks need.
bool PublisherWatch::isGone(const std::string& node) {
  std::unique_lock<std::mutex> lock(mutex_);
  std::optional<NodeAddress> address = nodes_.at(node).address;
  lock.unlock();
  if (!address) address = addressOf(node, deadlineIn(kNodeAnswer));
  const bool answers = address && isAlive(*address, deadlineIn(kNodeAnswer));
  lock.lock();
  Known& known = nodes_.at(node);
  known.address = address;
  known.unanswered = answers ? 0 : known.unanswered + 1;
  return known.unanswered > kMostUnheeded && !is_over_;
}

}  // namespace afterglow::nodes
