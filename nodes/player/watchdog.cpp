#include "nodes/player/watchdog.hpp"

#include <ros/ros.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <random>
#include <system_error>
#include <utility>

#include "nodes/guard/machine_name.hpp"
#include "nodes/tools/program.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/plan/permission.hpp"

namespace afterglow::nodes {
namespace {

/// The time for subscribers that the master names: a dead one never connects.
constexpr double kConnectedWithin = 2.0;  // s
constexpr double kAgain = 0.1;            // s, until outputs are sent again
/// Beats that are answered until a network is known.
constexpr std::uint32_t kBeatsNeeded = 20;
/// The beats without an answer after which a guard is gone: half a second beside the player, a
/// second afar.
constexpr std::uint32_t kMostBesideUnanswered = 25, kMostAfarUnanswered = 50;

std::uint64_t drawNumber() {
  std::random_device random;
  return (static_cast<std::uint64_t>(random()) << 32) | random();
}

}  // namespace

Watchdog::Watchdog(std::string name, std::unique_ptr<GuardWay> way, Listeners listeners)
    : name_(std::move(name)), way_(std::move(way)), listeners_(std::move(listeners)) {
  outputs_.player = drawNumber();
  outputs_.name = ros::this_node::getName();
  outputs_.machine = machineName();
}

void Watchdog::tellOutputs(const std::vector<replay::MotionMonitor::Output>& outputs) {
  outputs_.outputs.clear();
  for (const auto& [channel, stop] : outputs) {
    outputs_.outputs.push_back(
        {channel.topic, channel.type, channel.md5, channel.definition, stop});
  }
  ++outputs_.version;
  if (way_->isSure()) {
    way_->send(outputs_);
  } else {
    sendOutputsIfDue();
  }
}

/// Sends outputs again: the stop of a gripper changes with every beat.
void Watchdog::sendOutputsIfDue() {
  if (resend_at_ && std::chrono::steady_clock::now() < *resend_at_) return;
  way_->send(outputs_);
  resend_at_ = deadlineIn(kAgain);
}

/// A guard may know less of its graph than the graph of ROS 1 tells, for a while: it looks again at
/// another version.
void Watchdog::askAgain() {
  if (resend_at_ && std::chrono::steady_clock::now() < *resend_at_) return;
  ++outputs_.version;
  sendOutputsIfDue();
}

void Watchdog::beat(const replay::Outputs& moving, std::int64_t patience_ns) {
  send(moving, patience(patience_ns), false, false);
}

void Watchdog::send(const replay::Outputs& moving, std::int64_t patience_ns, bool stops,
                    bool ends) {
  GuardBeat beat;
  beat.player = outputs_.player;
  beat.count = ++count_;
  beat.sent_ns = static_cast<std::uint64_t>(replay::sinceBoot().ns);
  beat.patience_ms = static_cast<std::uint32_t>(patience_ns / 1'000'000);
  beat.stop = stops ? 1 : 0;
  beat.end = ends ? 1 : 0;
  beat.moving.assign(moving.begin(), moving.end());
  way_->send(beat);
}

std::int64_t Watchdog::patience(std::int64_t patience_ns) const {
  return isBeside() ? patience_ns
                    : std::min(std::max(patience_ns, afar_ns_), replay::kMostPatienceAfar);
}

void Watchdog::listen() {
  answer_ = way_->answer();
  if (!answer_.stopped.empty()) lose(name_ + " stopped the robot: " + answer_.stopped);
  if (!way_->isOpen()) lose(name_ + " is gone");
  const bool is_known = answer_.version == outputs_.version;
  if (!is_known && !way_->isSure()) sendOutputsIfDue();
  if (is_ready_) {
    const std::uint32_t most = isBeside() ? kMostBesideUnanswered : kMostAfarUnanswered;
    if (count_ > answer_.count + most) lose(name_ + " does not answer");
  } else if (is_known && isConnected() && isMeasured()) {
    is_ready_ = true;
    if (!isBeside()) afar_ns_ = replay::patienceAfar(longestGapNs());
  } else if (is_known && listeners_.are_sure && !isHeard()) {
    askAgain();
  }
}

bool Watchdog::isConnected() {
  if (!connected_by_) connected_by_ = deadlineIn(kConnectedWithin);
  if (isHeard()) return true;
  return !listeners_.are_sure && *connected_by_ <= std::chrono::steady_clock::now();
}

bool Watchdog::isMeasured() {
  if (first_answered_ == 0) first_answered_ = answer_.count;
  return answer_.count > 0 && (isBeside() || first_answered_ + kBeatsNeeded <= answer_.count);
}

/// Returns true if all that hear the outputs are connected, this node too: it listens for other
/// drivers.
bool Watchdog::isHeard() const {
  if (answer_.heard_by.size() != outputs_.outputs.size()) return false;
  for (std::size_t i = 0; i < outputs_.outputs.size(); ++i) {
    const auto nodes = listeners_.nodes.find(outputs_.outputs[i].topic);
    const std::size_t all = nodes == listeners_.nodes.end() ? 0 : nodes->second.size();
    if (answer_.heard_by[i] < all) return false;
  }
  return true;
}

void Watchdog::lose(const std::string& reason) {
  if (lost_.empty()) lost_ = reason;
}

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

std::string ros2WatchName() { return ros::names::resolve("afterglow_ros2_watch"); }

namespace {

std::set<std::string> ros2Bridges(const RosGraph& graph, const std::string& topic) {
  std::set<std::string> bridges;
  for (const std::string& node : graph.otherSubscribers(topic)) {
    if (graph.publishers.count(node + kRos2BridgeMark) > 0) bridges.insert(node);
  }
  return bridges;
}

}  // namespace

std::map<std::string, std::set<std::string>> ros2Listeners(const RosGraph& graph,
                                                           const std::vector<std::string>& topics) {
  std::map<std::string, std::set<std::string>> listeners;
  for (const std::string& topic : topics) {
    std::set<std::string> bridges = ros2Bridges(graph, topic);
    if (!bridges.empty()) listeners[topic] = std::move(bridges);
  }
  return listeners;
}

std::string whyUnwatched(const RosGraph& graph, const std::string& topic) {
  const std::set<std::string> bridges = ros2Bridges(graph, topic);
  if (bridges.empty() || RobotGuard::isThere(graph, ros2WatchName())) return "";
  return topic + " goes to a robot of ROS 2 over " + *bridges.begin() + ", and no " +
         ros2WatchName() +
         " runs there, which stops the robot when the bridge is gone (ros2.launch starts it)";
}

bool RobotGuard::isThere(const RosGraph& graph, const std::string& name) {
  return graph.otherSubscribers(name + "/outputs").count(name) > 0 &&
         isAlive(name, deadlineIn(kAlivePatience));
}

RobotGuard::RobotGuard(const std::string& name) {
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

namespace {

constexpr const char* kProgram = "afterglow_replay_guard";
constexpr double kEndPatience = 2;  // s

}  // namespace

std::string guardName() { return ros::this_node::getName() + "_guard"; }

GuardProcess::GuardProcess() {
  const auto [ours, its] = GuardSocket::makePair();
  socket_.emplace(ours);
  const GuardSocket other(its);
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe");
  ProgramStart start;
  start.input = its;
  start.output = start.error = ProgramStart::kOurs;
  // Ctrl-C and the end of a terminal are the player's.
  start.leader = ProgramStart::Leader::OfSession;
  const std::string program = own.parent_path() / kProgram;
  try {
    pid_ = startProgram({program, guardName()}, start);
  } catch (const std::system_error& error) {
    throw replay::MotionRefused("the watchdog " + program +
                                " cannot be started: " + error.code().message());
  }
}

GuardProcess::~GuardProcess() {
  socket_.reset();
  const Deadline deadline = deadlineIn(kEndPatience);
  while (::waitpid(pid_, nullptr, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() > deadline) ::kill(pid_, SIGKILL);
    ::usleep(5000);
  }
}

GuardAnswer GuardProcess::answer() {
  for (GuardSocket::Packet packet; !(packet = socket_->receive()).empty();) {
    GuardSocket::read(packet, answer_);
  }
  return answer_;
}

}  // namespace afterglow::nodes
