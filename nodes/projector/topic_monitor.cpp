#include "nodes/projector/topic_monitor.hpp"

#include <chrono>
#include <exception>
#include <utility>

#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::chrono::seconds kBetween(2);

TopicSources ask(const std::vector<std::string>& topics) {
  const RosGraph graph = askMaster(deadlineIn(kMasterPatience));
  const auto types = askTopicTypes(deadlineIn(kMasterPatience));
  TopicSources sources;
  for (const std::string& topic : topics) {
    TopicSource& source = sources[topic];
    const auto nodes = graph.otherPublishers(topic);
    source.publishers.assign(nodes.begin(), nodes.end());
    const auto type = types.find(topic);
    if (type != types.end() && type->second != "*" && !nodes.empty()) source.type = type->second;
  }
  return sources;
}

constexpr std::size_t kMostReasons = 32;

void count(std::map<std::string, std::uint64_t>& reasons, const std::string& reason) {
  const bool is_full = reasons.size() >= kMostReasons && reasons.count(reason) == 0;
  ++reasons[is_full ? "other reasons" : reason];
}

}  // namespace

TopicMonitor::TopicMonitor(std::vector<std::string> topics)
    : topics_(std::move(topics)), thread_(kBetween, [this] { look(); }) {
  thread_.begin();
}

TopicSources TopicMonitor::sources() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return sources_;
}

void TopicMonitor::look() {
  TopicSources sources;
  try {
    sources = ask(topics_);
  } catch (const std::exception&) {
    // Without a master nobody knows; what is connected goes on.
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  sources_ = std::move(sources);
}

void LayerStatus::drop(const std::string& reason) { count(dropped, reason); }
void LayerStatus::remark(const std::string& reason) { count(remarks, reason); }

}  // namespace afterglow::nodes
