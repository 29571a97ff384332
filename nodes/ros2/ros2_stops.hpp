/// \file
/// The stops of a player's outputs on ROS 2, where the robot is: what afterglow_ros2_watch sends
/// when nothing comes over the bridge any more.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "nodes/guard/guarded_player.hpp"
#include "nodes/ros2/dds.hpp"
#include "nodes/ros2/ros2_types.hpp"

namespace afterglow::nodes {

/// One thread.
class Ros2Stops {
 public:
  explicit Ros2Stops(DdsParticipant& participant)
      : participant_(participant), types_(participant, [] {}) {}

  /// A way for every output (GuardNode::MakeWays): a message of the readers' type, with an eye on
  /// other drivers where that is a velocity; for an action's cancel its service, with all goals;
  /// nothing where no node of ROS 2 listens, until it is asked again. Waits until the listeners are
  /// met. Throws std::runtime_error, one line, where a listener could not be stopped.
  GuardedPlayer::Ways ways(const GuardOutputs& outputs, const GuardedPlayer::Ways& known);

 private:
  std::shared_ptr<StopWay> wayOf(const GuardOutput& output);
  std::shared_ptr<StopWay> messageWay(const GuardOutput& output,
                                      const std::vector<DdsEndpoint>& all);
  std::string definitionOf(const std::string& type, const DdsEndpoint& reader);

  DdsParticipant& participant_;
  Ros2Types types_;
};

/// The heartbeats of players as they come over the bridge. `take` is called in a thread of DDS.
std::unique_ptr<DdsReader> hearBeats(DdsParticipant& participant, const std::string& topic,
                                     std::function<void(const GuardBeat&)> take);

}  // namespace afterglow::nodes
