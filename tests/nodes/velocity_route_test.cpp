#include "nodes/player/take_over.hpp"

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

namespace afterglow::nodes::velocity_route_test {
namespace {

const std::string kTwist = "geometry_msgs/Twist";

/// A Fetch's, with who only listens.
struct Fetch {
  RosGraph graph{{{"/cmd_vel", {"/move_base"}},
                  {"/teleop/cmd_vel", {"/teleop"}},
                  {"/base_controller/command", {"/cmd_vel_mux"}},
                  {"/cmd_vel_mux/selected", {"/cmd_vel_mux"}},
                  {"/odom", {"/robot"}}},
                 {{"/cmd_vel", {"/cmd_vel_mux", "/rosbag"}},
                  {"/teleop/cmd_vel", {"/cmd_vel_mux", "/rosbag"}},
                  {"/base_controller/command", {"/robot"}}},
                 {}};
  std::map<std::string, std::string> types{{"/cmd_vel", kTwist},
                                           {"/teleop/cmd_vel", kTwist},
                                           {"/base_controller/command", kTwist},
                                           {"/cmd_vel_mux/selected", "std_msgs/String"},
                                           {"/odom", "nav_msgs/Odometry"}};
};

TEST(VelocityRoute, leadsThroughAMultiplexer) {
  const Fetch fetch;
  const auto routes = velocityRoutes(fetch.graph, fetch.types, "/cmd_vel");
  ASSERT_EQ(routes.size(), 1u);
  EXPECT_EQ(routes[0].node, "/cmd_vel_mux");
  EXPECT_EQ(routes[0].output, "/base_controller/command");
  EXPECT_EQ(routes[0].inputs, std::vector<std::string>{"/teleop/cmd_vel"});
  EXPECT_EQ(routes[0].selected, "/cmd_vel_mux/selected");
}

TEST(VelocityRoute, isKnownBeforeAnythingWasPutOut) {
  Fetch fetch;
  fetch.graph.publishers.erase("/base_controller/command");
  fetch.graph.subscribers["/base_controller/command"] = {"/robot"};
  const auto routes = velocityRoutes(fetch.graph, fetch.types, "/cmd_vel");
  ASSERT_EQ(routes.size(), 1u);
  EXPECT_EQ(routes[0].output, "");
  EXPECT_EQ(routes[0].selected, "/cmd_vel_mux/selected");
}

TEST(VelocityRoute, isNoneWhereTheBaseListensItself) {
  Fetch fetch;
  EXPECT_TRUE(velocityRoutes(fetch.graph, fetch.types, "/base_controller/command").empty());
  fetch.graph.subscribers["/cmd_vel"] = {"/simulator"};
  fetch.graph.publishers["/one/cmd_vel"] = fetch.graph.publishers["/two/cmd_vel"] = {"/simulator"};
  fetch.types["/one/cmd_vel"] = fetch.types["/two/cmd_vel"] = kTwist;
  EXPECT_TRUE(velocityRoutes(fetch.graph, fetch.types, "/cmd_vel").empty())
      << "which of its velocities are ours?";
}

}  // namespace
}  // namespace afterglow::nodes::velocity_route_test
