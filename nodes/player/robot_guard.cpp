#include "nodes/player/robot_guard.hpp"

#include <algorithm>
#include <random>
#include <utility>

#include "nodes/guard/machine_name.hpp"
#include "nodes/player/guard_process.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::uint32_t kQueueOfBeats = 100;
constexpr double kAlivePatience = 0.5;  // s, for a node that may be dead
/// For subscribers that the master names: a dead one never connects.
constexpr double kConnectedWithin = 2.0;  // s
constexpr double kAgain = 0.1;            // s, until outputs are sent again
/// Beats that are answered until the link is known.
constexpr std::uint32_t kBeatsNeeded = 20;
/// Without an answer it is gone: half a second of beats beside the player, a second afar.
constexpr std::uint32_t kMostBesideUnanswered = 25, kMostAfarUnanswered = 50;

std::uint64_t drawNumber() {
  std::random_device random;
  return (static_cast<std::uint64_t>(random()) << 32) | random();
}

GuardOutput outputOf(const replay::MotionWatch::Output& output) {
  return {output.channel.topic, output.channel.type, output.channel.md5,
          output.channel.definition, output.stop};
}

}  // namespace

const char* const kNoRobotGuard =
    "no afterglow_guard runs on the robot: what is in motion is not stopped when the network is "
    "cut or this computer sleeps";

std::string robotGuardName() { return ros::names::resolve("afterglow_guard"); }

bool isGuard(const std::string& node) { return node == guardName() || node == robotGuardName(); }

bool RobotGuard::isThere(const RosGraph& graph) {
  const std::string name = robotGuardName();
  return graph.otherSubscribers(name + "/beats").count(name) > 0 &&
         isAlive(name, deadlineIn(kAlivePatience));
}

RobotGuard::RobotGuard(const RosGraph& graph) : graph_(graph) {
  outputs_.player = drawNumber();
  outputs_.name = ros::this_node::getName();
  outputs_.machine = machineName();
  node_.setCallbackQueue(&queue_);
  const std::string name = robotGuardName();
  outputs_topic_ = node_.advertise<GuardOutputs>(name + "/outputs", kQueueOfBeats);
  beats_ = node_.advertise<GuardBeat>(name + "/beats", kQueueOfBeats);
  ros::SubscribeOptions options;
  options.initByFullCallbackType<const GuardAnswer&>(
      name + "/answers", kQueueOfBeats, [this](const GuardAnswer& answer) {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (answer.player == outputs_.player) arrived_ = answer;
      });
  options.callback_queue = &queue_;
  options.transport_hints = ros::TransportHints().tcpNoDelay();
  answers_ = node_.subscribe(options);
  spinner_.start();
}

RobotGuard::~RobotGuard() {
  answers_.shutdown();
  spinner_.stop();
}

void RobotGuard::tellOutputs(const std::vector<replay::MotionWatch::Output>& outputs) {
  for (const replay::MotionWatch::Output& output : outputs) {
    outputs_.outputs.push_back(outputOf(output));
  }
  outputs_.version = 1;
}

void RobotGuard::tellOutput(const std::vector<replay::MotionWatch::Output>& outputs,
                            std::uint32_t changed) {
  outputs_.outputs[changed] = outputOf(outputs[changed]);
  ++outputs_.version;
  sendOutputsIfDue();
}

/// What stops a gripper changes with every beat.
void RobotGuard::sendOutputsIfDue() {
  if (!resend_at_ || *resend_at_ <= std::chrono::steady_clock::now()) sendOutputs();
}

void RobotGuard::sendOutputs() {
  outputs_topic_.publish(outputs_);
  resend_at_ = deadlineIn(kAgain);
}

void RobotGuard::beat(const replay::Outputs& moving, std::int64_t patience_ns) {
  send(moving, patience(patience_ns), false, false);
}

/// Whatever was in motion: the guard knows.
void RobotGuard::stop() { send({}, patience(0), true, false); }

void RobotGuard::end() { send({}, patience(0), false, true); }

void RobotGuard::send(const replay::Outputs& moving, std::int64_t patience_ns, bool stops,
                      bool ends) {
  GuardBeat beat;
  beat.player = outputs_.player;
  beat.count = ++count_;
  beat.sent_ns = static_cast<std::uint64_t>(replay::sinceBoot().ns);
  beat.patience_ms = static_cast<std::uint32_t>(patience_ns / 1'000'000);
  beat.stop = stops ? 1 : 0;
  beat.end = ends ? 1 : 0;
  beat.moving.assign(moving.begin(), moving.end());
  beats_.publish(beat);
}

std::int64_t RobotGuard::patience(std::int64_t patience_ns) const {
  return isBeside() ? patience_ns
                    : std::min(std::max(patience_ns, afar_ns_), replay::kMostPatienceAfar);
}

void RobotGuard::listen() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    answer_ = arrived_;
  }
  if (!answer_.stopped.empty()) {
    lose("the guard on the robot stopped it: " + answer_.stopped);
  }
  const bool is_known = answer_.version == outputs_.version;
  if (!is_known) sendOutputsIfDue();
  if (is_ready_) {
    const std::uint32_t most = isBeside() ? kMostBesideUnanswered : kMostAfarUnanswered;
    if (beats_.getNumSubscribers() == 0) lose("the guard on the robot is gone");
    if (count_ > answer_.count + most) lose("the guard on the robot does not answer");
  } else if (is_known && isConnected() && isMeasured()) {
    is_ready_ = true;
    if (!isBeside()) afar_ns_ = replay::patienceAfar(longestGapNs());
  }
}

bool RobotGuard::isConnected() {
  if (!connected_by_) connected_by_ = deadlineIn(kConnectedWithin);
  return isHeard() || *connected_by_ <= std::chrono::steady_clock::now();
}

bool RobotGuard::isMeasured() {
  if (first_answered_ == 0) first_answered_ = answer_.count;
  return answer_.count > 0 && (isBeside() || first_answered_ + kBeatsNeeded <= answer_.count);
}

/// By all that hear the outputs, this node too: it listens for other drivers.
bool RobotGuard::isHeard() const {
  if (answer_.heard_by.size() != outputs_.outputs.size()) return false;
  for (std::size_t i = 0; i < outputs_.outputs.size(); ++i) {
    const auto subscribers = graph_.subscribers.find(outputs_.outputs[i].topic);
    const std::size_t all =
        subscribers == graph_.subscribers.end() ? 0 : subscribers->second.size();
    if (answer_.heard_by[i] < all) return false;
  }
  return true;
}

void RobotGuard::lose(const std::string& reason) {
  if (lost_.empty()) lost_ = reason;
}

}  // namespace afterglow::nodes
