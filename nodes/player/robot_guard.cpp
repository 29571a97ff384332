#include "nodes/player/robot_guard.hpp"

#include "nodes/player/guard_process.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::uint32_t kQueueOfBeats = 100;
constexpr double kAlivePatience = 0.5;  // s, for a node that may be dead

}  // namespace

const char* const kNoRobotGuard =
    "no afterglow_guard runs on the robot: what is in motion is not stopped when the network is "
    "cut or this computer sleeps";

std::string robotGuardName() { return ros::names::resolve("afterglow_guard"); }

bool isGuard(const std::string& node) { return node == guardName() || node == robotGuardName(); }

bool isAnother(const std::string& node) {
  return node != ros::this_node::getName() && !isGuard(node);
}

bool RobotGuard::isThere(const RosGraph& graph) {
  const std::string name = robotGuardName();
  return graph.otherSubscribers(name + "/beats").count(name) > 0 &&
         isAlive(name, deadlineIn(kAlivePatience));
}

RobotGuard::RobotGuard() {
  const std::string name = robotGuardName();
  outputs_ = node_.advertise<GuardOutputs>(name + "/outputs", kQueueOfBeats);
  beats_ = node_.advertise<GuardBeat>(name + "/beats", kQueueOfBeats);
  const auto take = [this](const GuardAnswer& answer) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (answer.player == player_) arrived_ = answer;
  };
  thread_.hear<GuardAnswer>(name + "/answers", kQueueOfBeats, take,
                            ros::TransportHints().tcpNoDelay());
  thread_.begin();
}

void RobotGuard::send(const GuardBeat& beat) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    player_ = beat.player;
  }
  beats_.publish(beat);
}

GuardAnswer RobotGuard::answer() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return arrived_;
}

bool RobotGuard::isOpen() {
  const bool is_there = beats_.getNumSubscribers() > 0;
  was_found_ = was_found_ || is_there;
  return is_there || !was_found_;
}

}  // namespace afterglow::nodes
