/// \file
/// A graph of ROS 2 as DDS has it: names of topics, types and services, and how far the graph
/// reaches. Source: design.ros2.org/articles/topic_and_service_names.html; rmw_dds_common.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// "rt/a/b" of the topic "/a/b".
std::string ddsTopicName(const std::string& topic);
/// "/a/b" of "rt/a/b"; empty for what is no topic of a node: services, and whatever is not ROS 2's.
std::optional<std::string> topicOfDds(const std::string& dds_topic);

/// "geometry_msgs::msg::dds_::Twist_" of "geometry_msgs/msg/Twist".
std::string ddsTypeName(const std::string& ros2_type);
/// "geometry_msgs/msg/Twist" of that; empty for a type that is not ROS 2's.
std::optional<std::string> typeOfDds(const std::string& dds_type);

/// The two topics of a service, with their types.
struct ServiceNames {
  std::string request_topic, request_type, reply_topic, reply_type;
};
/// `service`: "/node/get_type_description"; `type`: "type_description_interfaces/srv/
/// GetTypeDescription". An action's: "/fibonacci/_action/send_goal" of
/// "test_msgs/action/Fibonacci_SendGoal".
ServiceNames serviceNames(const std::string& service, const std::string& type);
/// "/node/get_type_description" of "rq/node/get_type_descriptionRequest"; empty for what is no
/// topic of requests.
std::optional<std::string> serviceOfDds(const std::string& request_topic);

/// The topic on which each participant tells of its nodes, as DDS has it.
inline constexpr const char* kNodesTopic = "ros_discovery_info";
inline constexpr const char* kNodesType = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";
/// The message there of a participant that has one node, without its readers and writers, in CDR.
/// `participant`: its GUID, 16 bytes; `node`: "/robot1/bridge". Nodes before Iron, which tell no
/// types' hashes, have GUIDs of 24 bytes there.
Bytes nodeAnnouncement(const Bytes& participant, const std::string& node, bool is_before_iron);

/// Whether a bridge carries the topic: not the graph's own (/rosout, /parameter_events), nor those
/// of actions, which are translated.
bool isBridged(const std::string& topic);

/// How far a graph reaches.
struct Ros2Network {
  std::uint32_t domain = 0;
  bool is_subnet = false;  ///< other machines, too; else this machine alone
};
/// `asked`: "machine", "subnet", or empty: as ROS_AUTOMATIC_DISCOVERY_RANGE and ROS_LOCALHOST_ONLY
/// say, which `variable` returns as it does ROS_DOMAIN_ID (null: not set); without them this
/// machine alone. Throws std::invalid_argument, one line, for what is none of these.
Ros2Network ros2Network(const std::string& asked,
                        const std::function<const char*(const char*)>& variable);

}  // namespace afterglow::replay
