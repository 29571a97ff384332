#include "nodes/player/state_validity.hpp"

namespace afterglow::nodes {
namespace {

constexpr const char* kAnyMd5 = "*";

}  // namespace

StateValidity::StateValidity(const replay::RobotNames& robot) {
  ros::NodeHandle node;
  name_ = node.resolveName(robot.topic("/check_state_validity"));
  ros::ServiceClientOptions options(name_, kAnyMd5, true, {});
  client_ = node.serviceClient(options);
}

bool StateValidity::isThere() const { return ros::service::exists(name_, false); }

std::string StateValidity::whyNot(const std::vector<std::string>& joints,
                                  const std::vector<double>& positions) {
  StateValidityRequest request;
  request.joint_state.name = joints;
  request.joint_state.position = positions;
  StateValidityResponse response;
  if (!client_.call(request, response, kAnyMd5)) return name_ + " does not answer";
  return response.valid != 0 ? "" : "by MoveIt it would collide there";
}

}  // namespace afterglow::nodes
