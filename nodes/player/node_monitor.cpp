#include "nodes/player/node_monitor.hpp"

#include <ros/master.h>

#include <utility>

namespace afterglow::nodes {
namespace {

constexpr double kAskingPeriod = 0.25;  // s
// s, for one answer on a busy machine; after one that was late the next is asked for at once.
constexpr double kMasterAnswer = 1.1, kNodeAnswer = 0.6;
constexpr int kMostUnheeded = 1;

}  // namespace

MasterMonitor::MasterMonitor(std::function<void(const std::string&)> on_lost)
    : on_lost_(std::move(on_lost)) {
  thread_.every(kAskingPeriod, [this] { look(); });
  thread_.begin();
}

void MasterMonitor::look() {
  if (missed_ > kMostUnheeded) return;
  missed_ = master_.isThere(deadlineIn(kMasterAnswer)) ? 0 : missed_ + 1;
  if (missed_ > kMostUnheeded) on_lost_("the ROS master is gone (" + ros::master::getURI() + ")");
}

PublisherMonitor::PublisherMonitor(std::function<void(const std::string&)> on_gone)
    : on_gone_(std::move(on_gone)) {
  thread_.every(kAskingPeriod, [this] { look(); });
  thread_.begin();
}

void PublisherMonitor::add(const std::string& node) {
  const std::lock_guard<std::mutex> lock(mutex_);
  nodes_.insert(node);
}

/// Asks without the lock, which callbacks need.
void PublisherMonitor::look() {
  std::set<std::string> nodes;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    nodes = nodes_;
  }
  for (const std::string& node : nodes) {
    if (has_told_ || !isGone(node)) continue;
    has_told_ = true;
    on_gone_(node);
  }
}

bool PublisherMonitor::isGone(const std::string& node) {
  Known& known = known_[node];
  if (!known.address) known.address = addressOf(node, deadlineIn(kNodeAnswer));
  const bool answers = known.address && isAlive(*known.address, deadlineIn(kNodeAnswer));
  known.unanswered = answers ? 0 : known.unanswered + 1;
  return known.unanswered > kMostUnheeded;
}

}  // namespace afterglow::nodes
