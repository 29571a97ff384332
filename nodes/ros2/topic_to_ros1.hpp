/// \file
/// A topic of ROS 2 on ROS 1.
#pragma once

#include <ros/ros.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "nodes/conversion/typed_message.hpp"
#include "nodes/ros2/bridge_refusals.hpp"
#include "nodes/ros2/dds.hpp"
#include "replay/ros2/ros2_topic.hpp"

namespace afterglow::nodes {

/// Advertised while it exists; read while somebody on ROS 1 subscribes, by one DDS reader for each
/// kind of quality that its writers offer. What transient local writers gave is latched, each
/// writer's own last message, and read on until the writer goes: a late subscriber gets the newest.
class TopicToRos1 {
 public:
  struct Options {
    std::string dds_type;
    std::int32_t depth = 10000;
    bool is_latched = false;          ///< by the writers known so far
    std::function<void()> on_demand;  ///< a subscriber came or went; any thread
  };

  TopicToRos1(DdsParticipant& participant, BridgeRefusals& refusals, replay::Ros2Topic conversion,
              Options options);

  /// To be called when writers or subscribers changed. `own_links`: subscribers that are this
  /// process's own. Throws as DdsReader.
  void update(const std::vector<DdsEndpoint>& writers, std::size_t own_links);

  const std::string& ros1Type() const { return conversion_.channel().type; }
  const std::string& ddsType() const { return options_.dds_type; }
  bool isCarried() const { return !readers_.empty(); }
  CarriedCount count() const;  ///< not during update()

 private:
  /// Messages that roscpp has not sent yet to all subscribers: as many as the slowest one is
  /// behind, but for those that are latched.
  struct Waiting {
    std::atomic<std::size_t> messages{0}, bytes{0};
  };

  ros::Publisher advertise(bool is_latched);
  void publish(ros::Publisher& publisher, replay::Bytes&& bytes);
  void take(const std::pair<bool, bool>& kind, DdsSample&& sample);
  ros::Publisher& publisherOf(const DdsGuid& writer, bool is_latched);

  DdsParticipant& participant_;
  BridgeRefusals& refusals_;
  const Options options_;
  mutable std::mutex mutex_;  ///< conversion_, latched_, count_
  replay::Ros2Topic conversion_;
  ros::NodeHandle node_;
  ros::Publisher publisher_;
  std::map<DdsGuid, ros::Publisher> latched_;  ///< of transient local writers
  std::shared_ptr<Waiting> waiting_ = std::make_shared<Waiting>();
  CarriedCount count_;
  std::map<std::pair<bool, bool>, std::unique_ptr<DdsReader>> readers_;  ///< last: use the rest
};

}  // namespace afterglow::nodes
