/// \file
/// The ROS master: whether it answers, who publishes and who subscribes, asked of the master and of
/// the nodes themselves, with a deadline; and a node's registration. Sources:
/// wiki.ros.org/ROS/Master_API, wiki.ros.org/ROS/Slave_API.
///
/// The robot that this process belongs to, where there are several: ROS's namespace, what the
/// parameter server knows of the robot in one, and a node's ~store.
#pragma once

#include <ros/node_handle.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "replay/clock/worker_thread.hpp"

namespace afterglow::nodes {

using Deadline = std::chrono::steady_clock::time_point;

inline Deadline deadlineIn(double seconds) {
  return std::chrono::steady_clock::now() +
         std::chrono::duration_cast<std::chrono::steady_clock::duration>(
             std::chrono::duration<double>(seconds));
}

/// Looks again and again. False: it did not hold by the deadline, or when `is_stopped`.
template <typename Condition, typename IsStopped>
bool waitUntil(Deadline deadline, const IsStopped& is_stopped, const Condition& holds) {
  while (!holds()) {
    if (is_stopped() || std::chrono::steady_clock::now() >= deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

template <typename Condition>
bool waitUntil(Deadline deadline, const Condition& holds) {
  return waitUntil(deadline, [] { return false; }, holds);
}

/// A running master answers at once; roscpp itself would wait forever.
constexpr double kMasterPatience = 2.0;

/// Node names by topic, or service, as the master knows them.
struct RosGraph {
  std::map<std::string, std::set<std::string>> publishers, subscribers, services;

  /// All but this node itself.
  std::set<std::string> otherPublishers(const std::string& topic) const;
  std::set<std::string> otherSubscribers(const std::string& topic) const;
};

/// The address at which a node answers.
struct NodeAddress {
  std::string host;
  std::uint32_t port = 0;
};

/// A connection to the master that is kept from question to question, for those who ask again and
/// again: the master, a Python program, begins a thread for each new one, which costs it 0.6 ms
/// of a processor where a question on an old one costs 0.1. A lost connection is made anew by the
/// next question. One thread.
class MasterLink {
 public:
  MasterLink();
  ~MasterLink();
  MasterLink(const MasterLink&) = delete;
  MasterLink& operator=(const MasterLink&) = delete;

  /// Returns true if the master answers in time.
  bool isThere(Deadline deadline);
  /// Throws std::runtime_error, one line, if the master does not answer in time.
  RosGraph graph(Deadline deadline);
  /// The type of every topic by its latest publisher, "package/Type". Throws as graph().
  std::map<std::string, std::string> topicTypes(Deadline deadline);
  /// Returns the address by the master; empty if it does not know it, or does not answer.
  std::optional<NodeAddress> addressOf(const std::string& node, Deadline deadline);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Each asks once, by a MasterLink of its own.
RosGraph askMaster(Deadline deadline);
std::map<std::string, std::string> askTopicTypes(Deadline deadline);
std::optional<NodeAddress> addressOf(const std::string& node, Deadline deadline);

/// Returns true if that node answers; a dead node may stay registered forever.
bool isAlive(const std::string& node, Deadline deadline);
bool isAlive(const NodeAddress& address, Deadline deadline);

/// Numbers of connections, by publishing node and topic, as that node counts them.
using Links = std::map<std::pair<std::string, std::string>, std::set<std::string>>;

/// Connections to this node that the announced publishers of these topics list. A node may list a
/// connection long after it was closed here (rospy, until it publishes again).
Links linksHere(const std::vector<std::string>& topics, Deadline deadline);

/// Waits until every announced publisher of these topics lists this node as a subscriber, by
/// another connection than the `old` ones: from then on no message is missed. Returns the
/// publishers that did not ("/node on /topic"). Dead and hung nodes only cost the wait.
std::vector<std::string> waitForPublishers(const std::vector<std::string>& topics,
                                           Deadline deadline, const Links& old = {});

/// Waits, before ros::init, which waits for a master forever if the command line has a parameter
/// (_name:=value), and after catchStopSignals(), until the master of ROS_MASTER_URI, or of an
/// argument __master:=URI, answers, and says so on stderr, which begins with `node`. False: a stop
/// was requested first. Throws std::runtime_error for a URI that is none.
bool awaitMaster(int argc, char** argv, const std::string& node);

/// A node's registration: a master that is killed and started again knows no node, and roscpp does
/// not tell it, so that the node's services could not be called any more. Looks every second
/// whether the master knows this node, in a thread of its own. A master that does not is told all
/// that the node publishes, subscribes to and serves. Connections between nodes do not depend on
/// the master and last through its absence. To be made after ros::init; it has to end before ROS
/// shuts down.
class Registration {
 public:
  Registration();

 private:
  void look();
  bool registerAgain() const;

  std::set<std::string> services_;  ///< services of this node, as a master has told
  bool was_known_ = false;
  replay::RepeatingThread thread_;  ///< last: uses all of the above
};

/// Makes roscpp give up after a second where no master answers; otherwise it waits for one for
/// ever, and no stop can end the program. A subscription that was given up is empty
/// (`!subscriber`), and has to be tried again. A node calls this once it has begun.
void boundWaitsForMaster();

/// Returns the other publisher of /clock, by the master; empty: there is none. Throws
/// std::runtime_error without a master.
std::string clockPublisher();

/// Waits for a time other than 0, which every stamp would be. Throws std::runtime_error, one line,
/// if there is none at the deadline, or if /use_sim_time was set after this node had begun.
void requireTime(Deadline deadline);

/// Returns this process's own namespace, "/robot1": as ROS was told at its start, before that
/// $ROS_NAMESPACE; empty: the global one.
std::string rosNamespace();

/// A text of the robot in that namespace, robot_description or tf_prefix: there, else in those
/// around it. Empty: there is none, or no master answers.
std::string robotParameter(const std::string& name_space, const std::string& name);

/// Throws replay::StoreError for a URI with a password, which everybody on the network can read:
/// the parameter is deleted then.
void refuseStorePassword(const ros::NodeHandle& private_node, const std::string& store);

}  // namespace afterglow::nodes
