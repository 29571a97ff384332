// Names and range of a graph of ROS 2 in DDS.
#include "replay/ros2/ros2_graph.hpp"

#include <gtest/gtest.h>

#include <map>
#include <stdexcept>

#include "tests/support/cdr_bytes.hpp"

namespace afterglow::replay::ros2_graph_test {
namespace {

using Variables = std::map<std::string, std::string>;

Ros2Network networkOf(const std::string& asked, const Variables& variables) {
  return ros2Network(asked, [&variables](const char* name) {
    const auto found = variables.find(name);
    return found == variables.end() ? nullptr : found->second.c_str();
  });
}

std::string refusalOf(const std::string& asked, const Variables& variables) {
  try {
    networkOf(asked, variables);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Ros2Graph, namesTopicsAndTypesAsRmwDoes) {
  EXPECT_EQ(ddsTopicName("/a/b"), "rt/a/b");
  EXPECT_EQ(topicOfDds("rt/a/b"), "/a/b");
  EXPECT_EQ(topicOfDds("rq/a/bRequest"), std::nullopt);
  EXPECT_EQ(topicOfDds("ros_discovery_info"), std::nullopt);
  EXPECT_EQ(ddsTypeName("geometry_msgs/msg/Twist"), "geometry_msgs::msg::dds_::Twist_");
  EXPECT_EQ(typeOfDds("geometry_msgs::msg::dds_::Twist_"), "geometry_msgs/msg/Twist");
  for (const char* other : {"HelloWorld", "a::b", "dds_::x_", "::dds_::x_", "a::msg::dds_::B",
                            "a/b::msg::dds_::T_", ""}) {
    EXPECT_EQ(typeOfDds(other), std::nullopt) << other;
  }
}

TEST(Ros2Graph, namesServicesAsRmwDoes) {
  const ServiceNames names =
      serviceNames("/fibonacci/_action/send_goal", "test_msgs/action/Fibonacci_SendGoal");
  EXPECT_EQ(names.request_topic, "rq/fibonacci/_action/send_goalRequest");
  EXPECT_EQ(names.request_type, "test_msgs::action::dds_::Fibonacci_SendGoal_Request_");
  EXPECT_EQ(names.reply_topic, "rr/fibonacci/_action/send_goalReply");
  EXPECT_EQ(names.reply_type, "test_msgs::action::dds_::Fibonacci_SendGoal_Response_");
  EXPECT_EQ(serviceOfDds(names.request_topic), "/fibonacci/_action/send_goal");
  EXPECT_EQ(serviceOfDds(names.reply_topic), std::nullopt);
}

TEST(Ros2Graph, isToldOfANode) {
  const Bytes guid(16, 7);
  const Bytes cdr = test::CdrBytes(false, 0)
                        .put(std::uint64_t{0x0707070707070707})
                        .put(std::uint64_t{0x0707070707070707})
                        .put(1)
                        .text("/robot1")
                        .text("bridge")
                        .put(0)
                        .put(0);
  EXPECT_EQ(nodeAnnouncement(guid, "/robot1/bridge", false), cdr);
  Bytes longer = cdr;
  longer.insert(longer.begin() + 20, 8, 0);
  EXPECT_EQ(nodeAnnouncement(guid, "/robot1/bridge", true), longer);
  EXPECT_EQ(nodeAnnouncement(guid, "/b", false)[28], '/');
}

TEST(Ros2Graph, keepsTheGraphsOwnTopics) {
  EXPECT_TRUE(isBridged("/tf"));
  EXPECT_TRUE(isBridged("/arm/joint_states"));
  for (const char* own : {"/rosout", "/parameter_events", "/arm/_action/status", "/a/_hidden"}) {
    EXPECT_FALSE(isBridged(own)) << own;
  }
}

TEST(Ros2Graph, reachesThisMachineUnlessAsked) {
  EXPECT_FALSE(networkOf("", {}).is_subnet);
  EXPECT_EQ(networkOf("", {}).domain, 0U);
  EXPECT_TRUE(networkOf("", {{"ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"}}).is_subnet);
  EXPECT_FALSE(networkOf("machine", {{"ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"}}).is_subnet);
  EXPECT_TRUE(networkOf("subnet", {{"ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"}}).is_subnet);
  EXPECT_FALSE(
      networkOf("", {{"ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"}, {"ROS_LOCALHOST_ONLY", "1"}})
          .is_subnet);
  EXPECT_EQ(networkOf("", {{"ROS_DOMAIN_ID", "42"}}).domain, 42U);
}

TEST(Ros2Graph, refusesWhatIsNoRangeAndNoDomain) {
  EXPECT_EQ(refusalOf("world", {}), "~network is 'world'; expected machine or subnet");
  EXPECT_EQ(refusalOf("", {{"ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"}}),
            "ROS_AUTOMATIC_DISCOVERY_RANGE is 'OFF'; expected LOCALHOST or SUBNET");
  for (const char* domain : {"-1", "233", "7a", "99999999999"}) {
    EXPECT_EQ(refusalOf("", {{"ROS_DOMAIN_ID", domain}}),
              "ROS_DOMAIN_ID is '" + std::string(domain) + "'; expected a number from 0 to 232");
  }
}

}  // namespace
}  // namespace afterglow::replay::ros2_graph_test
