/// \file
/// A topic of ROS 1 on ROS 2.
#pragma once

#include <ros/ros.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "nodes/conversion/typed_message.hpp"
#include "nodes/ros2/bridge_refusals.hpp"
#include "nodes/ros2/dds.hpp"
#include "nodes/tools/immediate_callbacks.hpp"
#include "replay/ros2/message_to_ros2.hpp"

namespace afterglow::nodes {

/// Subscribed to, and written as the type that readers of ROS 2 ask for, while it exists. Each
/// publisher that latches has a writer of its own, transient local, with its last message. Messages
/// are converted, and leave, as they are read: what comes faster makes its publisher wait.
class TopicToRos2 {
 public:
  struct Options {
    std::string topic;
    std::string ros2_type;            ///< "geometry_msgs/msg/Twist", the readers'
    std::string definition;           ///< of it, as Ros2Types tells it
    bool is_transient_local = false;  ///< asked for by a reader, whatever the publishers do
    std::int32_t depth = 10000;
    /// Type and MD5 of the publishers that are heard; empty: those of the first.
    std::string ros1_type = {}, ros1_md5 = {};
  };

  /// Throws as DdsWriter.
  TopicToRos2(DdsParticipant& participant, BridgeRefusals& refusals, Options options);
  ~TopicToRos2() { subscriber_.shutdown(); }
  TopicToRos2(const TopicToRos2&) = delete;
  TopicToRos2& operator=(const TopicToRos2&) = delete;

  /// To be called again and again; `publishers`: names of nodes; `readers`: their number.
  /// Subscribes once the readers are met, as what is written before is lost. Returns false until
  /// then.
  bool update(const std::set<std::string>& publishers, std::size_t readers);
  CarriedCount count() const;

  const Options& options() const { return options_; }
  /// Whether it hears this process's own publishers of that type as well.
  bool hears(const std::string& ros1_type) const {
    return options_.ros1_type.empty() || options_.ros1_type == ros1_type;
  }

 private:
  using Event = ros::MessageEvent<RawMessage>;
  /// A connection to a publisher.
  struct Source {
    std::string caller, type;
    bool is_latching = false;
    std::optional<replay::MessageToRos2> conversion;  ///< empty: it is refused
  };

  void subscribe();
  void write(DdsWriter& writer, const replay::Bytes& cdr);
  void onMessage(const Event& event);
  Source& sourceOf(const Event& event);
  Source sourceWith(const ros::M_string& header);
  DdsWriter& writerOf(const Source& source);

  DdsParticipant& participant_;
  BridgeRefusals& refusals_;
  const Options options_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  mutable std::mutex mutex_;                                    ///< sources_, writers_, count_
  std::map<boost::shared_ptr<ros::M_string>, Source> sources_;  ///< by connection header
  /// By caller, of those that latch; "": of all others.
  std::map<std::string, std::unique_ptr<DdsWriter>> writers_;
  CarriedCount count_;
  ros::NodeHandle node_;
  ImmediateCallbacks immediately_;
  ros::Subscriber subscriber_;
};

}  // namespace afterglow::nodes
