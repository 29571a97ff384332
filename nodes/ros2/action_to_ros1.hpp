/// \file
/// An action whose server is in ROS 2, on ROS 1.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "nodes/ros2/action_on_ros1.hpp"
#include "nodes/ros2/dds.hpp"
#include "replay/ros2/action_relay.hpp"

namespace afterglow::nodes {

/// The server of the action for clients in ROS 1 while it exists: its five topics, once it has met
/// the server in ROS 2. Goals and cancels of clients in ROS 2 are published there as well.
class ActionToRos1 {
 public:
  struct Options {
    std::string action;     ///< "/fibonacci"
    std::string ros2_type;  ///< "test_msgs/action/Fibonacci"
    DdsGuid server;         ///< the server's reader of goals
    bool is_feedback_reliable = true;
  };

  /// Throws as DdsWriter.
  ActionToRos1(DdsParticipant& participant, const replay::ActionType& type, Options options);
  /// Cancels the goals of ROS 1, and waits a moment until the server has heard it.
  ~ActionToRos1();
  ActionToRos1(const ActionToRos1&) = delete;
  ActionToRos1& operator=(const ActionToRos1&) = delete;

  /// Begins on ROS 1 once the server can be reached. Returns whether it has begun.
  bool begin();
  /// Tells ROS 1 that its goals are over.
  void onServerGone();

  const DdsGuid& server() const { return options_.server; }

 private:
  struct Service {
    std::unique_ptr<DdsWriter> requests;
    const DdsReader* replies = nullptr;
    std::unique_ptr<DdsWriter> silent;  ///< a writer of replies that writes none
  };

  replay::ActionRelay::Outlets outlets();
  replay::RequestId request(replay::ActionService service, const replay::Bytes& cdr);
  void addService(DdsParticipant& participant, replay::ActionService service,
                  const replay::ServiceNames& names);
  void addTopic(DdsParticipant& participant, const std::string& name, const std::string& type,
                const DdsQos& qos,
                void (replay::ActionRelay::*hear)(const replay::Bytes& cdr, replay::Stamp now));
  bool isServers(const std::vector<DdsGuid>& matched) const;
  /// Returns true once all of the server's services and topics are met: feedback that comes before
  /// is lost.
  bool isServed() const;

  const Options options_;
  const replay::ActionType type_;
  replay::ActionRelay relay_;             ///< used in the thread of `ros1_` alone
  std::atomic<bool> is_complete_{false};  ///< before that, nothing can be asked
  std::atomic<int> cancels_{0};           ///< cancels that wait for their replies
  std::map<replay::ActionService, Service> services_;
  ActionOnRos1 ros1_;
  std::vector<const DdsReader*> topics_;             ///< readers of feedback and status
  std::vector<std::unique_ptr<DdsReader>> readers_;  ///< last: they post to `ros1_`
};

}  // namespace afterglow::nodes
