/// \file
/// ros2_bridge_node: topics of a graph of ROS 2 on ROS 1, and the other way round, each while
/// somebody on the other side wants it.
#pragma once

#include <ros/ros.h>

#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "nodes/ros2/bridge_refusals.hpp"
#include "nodes/ros2/dds.hpp"
#include "nodes/ros2/robot_descriptions.hpp"
#include "nodes/ros2/ros2_actions.hpp"
#include "nodes/ros2/ros2_types.hpp"
#include "nodes/ros2/topic_to_ros1.hpp"
#include "nodes/ros2/topic_to_ros2.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {

/// The network that the parameter ~network and ROS 2's own environment name. Throws
/// std::invalid_argument, one line.
replay::Ros2Network readRos2Network(const ros::NodeHandle& own);

struct Ros2BridgeOptions {
  replay::Ros2Network network;
  std::int32_t depth = 10000;  ///< messages that wait on either side of a topic, at most

  /// From the parameter ~depth and readRos2Network(). Throws std::invalid_argument, one line.
  static Ros2BridgeOptions read(const ros::NodeHandle& own);
};

class Ros2BridgeNode {
 public:
  /// Throws std::runtime_error if DDS cannot begin.
  explicit Ros2BridgeNode(const Ros2BridgeOptions& options);
  ~Ros2BridgeNode();
  Ros2BridgeNode(const Ros2BridgeNode&) = delete;
  Ros2BridgeNode& operator=(const Ros2BridgeNode&) = delete;

 private:
  /// The readers and writers of a topic on ROS 2.
  struct Sides {
    std::vector<DdsEndpoint> writers, readers;
  };

  void wake();
  void tellMisfit(const std::string& topic, const std::string& policy);
  void work();
  /// Brings what is carried in line with both graphs. Returns false if an answer is awaited.
  bool look();
  /// Tells the graph of ROS 2 of this node.
  void announce(const std::vector<DdsEndpoint>& all);
  void askRos1();
  bool toRos1(const std::string& topic, const std::vector<DdsEndpoint>& writers,
              const std::vector<DdsEndpoint>& all);
  bool toRos2(const std::string& topic, const std::vector<DdsEndpoint>& readers,
              const std::vector<DdsEndpoint>& all);
  void updateToRos1(const std::string& topic, const std::vector<DdsEndpoint>& writers);
  TopicToRos2::Options optionsToRos2(const std::string& topic, const std::string& ros2_type,
                                     const std::vector<DdsEndpoint>& readers) const;
  void publishDiagnostics();
  /// Says once that no node of ROS 2 is there, and once that there are some again.
  void tellWhetherAlone();

  const Ros2BridgeOptions options_;
  ros::NodeHandle node_;
  BridgeRefusals refusals_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_changed_ = false, is_ending_ = false;
  DdsParticipant participant_;
  std::unique_ptr<DdsWriter> announcement_;
  Ros2Types types_;
  MasterLink master_;
  RosGraph ros1_;  ///< as the master told last
  std::map<std::string, std::string> ros1_types_;
  std::mutex carried_mutex_;  ///< the next four, of which diagnostics tell
  bool is_alone_ = false;     ///< no node of ROS 2 is there
  std::map<std::string, std::unique_ptr<TopicToRos1>> to_ros1_;
  std::map<std::string, std::unique_ptr<TopicToRos2>> to_ros2_;
  Ros2Actions actions_;
  RobotDescriptions descriptions_;
  ros::Publisher diagnostics_, mark_;
  ros::SteadyTimer timer_;
  bool was_alone_ = false;  ///< as it was said last
  std::thread thread_;  ///< last: uses all of the above
};

}  // namespace afterglow::nodes
