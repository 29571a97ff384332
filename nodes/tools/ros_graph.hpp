/// \file
/// Who publishes and who listens, asked of the master and of the nodes themselves, never waiting
/// longer than one says. Sources: wiki.ros.org/ROS/Master_API, wiki.ros.org/ROS/Slave_API.
#pragma once

#include <chrono>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace afterglow::nodes {

using Deadline = std::chrono::steady_clock::time_point;

inline Deadline deadlineIn(double seconds) {
  return std::chrono::steady_clock::now() +
         std::chrono::duration_cast<std::chrono::steady_clock::duration>(
             std::chrono::duration<double>(seconds));
}

/// A master that is there answers at once; roscpp itself would wait for ever.
constexpr double kMasterPatience = 2.0;

/// Node names by topic, or service, as the master knows them.
struct RosGraph {
  std::map<std::string, std::set<std::string>> publishers, subscribers, services;

  /// Those but this node itself.
  std::set<std::string> otherPublishers(const std::string& topic) const;
  std::set<std::string> otherSubscribers(const std::string& topic) const;
};

/// Throws std::runtime_error, one line, if the master does not answer in time.
RosGraph askMaster(Deadline deadline);

/// Whether that node answers; one that died may be registered for ever.
bool isAlive(const std::string& node, Deadline deadline);

/// The type of every topic by its latest publisher, "package/Type". Throws as askMaster().
std::map<std::string, std::string> askTopicTypes(Deadline deadline);

/// Numbers of connections, by publishing node and topic, as that node counts them.
using Links = std::map<std::pair<std::string, std::string>, std::set<std::string>>;

/// Connections that announced publishers of these topics believe to have to this node. A node may
/// list one for long after this one has closed it (rospy, until it publishes again).
Links linksHere(const std::vector<std::string>& topics, Deadline deadline);

/// Waits until every announced publisher of these topics counts this node among its subscribers, by
/// another connection than the `old` ones: from then on no message is missed. Returns those that
/// did not ("/node on /topic"); topics without publishers are none. Dead and hung nodes cost the
/// wait, not more.
std::vector<std::string> waitForPublishers(const std::vector<std::string>& topics,
                                           Deadline deadline, const Links& old = {});

}  // namespace afterglow::nodes
