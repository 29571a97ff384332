/// \file
/// Descriptions of robots, which ROS 2 has as latched topics, as parameters on ROS 1.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "nodes/ros2/bridge_refusals.hpp"
#include "nodes/ros2/dds.hpp"

namespace afterglow::nodes {

/// Reads every robot_description of ROS 2, and sets ROS 1's parameter of that name, which recorder
/// and player go by, unless it is set to something else already. It stays set. One thread calls.
class RobotDescriptions {
 public:
  /// `on_told` is called in a thread of DDS once set() has something to do.
  RobotDescriptions(DdsParticipant& participant, BridgeRefusals& refusals,
                    std::function<void()> on_told);

  /// Hears those that are in the graph. Throws as DdsReader.
  void look(const std::vector<DdsEndpoint>& all);
  /// Sets what was told since the last call. The master should be there: roscpp waits for it.
  void set();

 private:
  void take(const std::string& topic, const DdsSample& sample);

  DdsParticipant& participant_;
  BridgeRefusals& refusals_;
  const std::function<void()> on_told_;
  std::set<std::string> own_;                                  ///< parameters that were set here
  std::mutex mutex_;                                           ///< told_
  std::map<std::string, std::string> told_;                    ///< texts by topic
  std::map<std::string, std::unique_ptr<DdsReader>> readers_;  ///< last: by topic; use the rest
};

}  // namespace afterglow::nodes
