/// \file
/// The running robot's topics over the Foxglove WebSocket protocol.
#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "nodes/console/foxglove_protocol.hpp"
#include "nodes/tools/callback_thread.hpp"
#include "nodes/tools/immediate_callbacks.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/clock/worker_thread.hpp"
#include "replay/messages/definitions.hpp"

namespace afterglow::nodes {

class FoxgloveLiveSession;

/// All topics that are published now, for all clients: announced as they come and go, and listened
/// to as long as a client subscribes. A type's definition is this machine's, else that of the first
/// message, until which the topic is not announced. After ros::init; any thread.
class FoxgloveLive {
 public:
  FoxgloveLive();

  // Of a session.
  /// From now on it is told of all channels and of the time.
  void join(FoxgloveLiveSession& session);
  void leave(FoxgloveLiveSession& session);
  ros::NodeHandle& node() { return node_; }

 private:
  static constexpr std::size_t kMostTopics = 5000;  ///< against nodes that make ever new ones

  using Types = std::map<std::string, std::string>;  ///< types by topic

  void tick();
  void look();
  void change(const Types& types);
  std::optional<replay::Definition> definitionOf(const std::string& topic, const std::string& type);
  void learn(const AnyMessage& event);

  const replay::FindDefinition find_installed_ = replay::findInstalled();
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;

  std::mutex look_mutex_;  ///< the next three
  MasterLink master_;
  std::map<std::string, FoxgloveChannel> announced_;  ///< by topic
  std::map<std::string, ros::Subscriber> unknown_;    ///< heard once, for a type's definition
  std::uint32_t channels_ever_ = 0;

  std::mutex definitions_mutex_;
  std::map<std::string, std::optional<replay::Definition>> definitions_;  ///< by type

  std::mutex sessions_mutex_;
  std::set<FoxgloveLiveSession*> sessions_;

  int ticks_ = 0;  ///< the thread's
  ros::AsyncSpinner spinner_;
  replay::RepeatingThread thread_;  ///< last: uses all of the above
};

/// A client. Slow ones lose the oldest messages, and are told.
class FoxgloveLiveSession final : public FoxgloveSession {
 public:
  FoxgloveLiveSession(std::shared_ptr<FoxgloveLive> live, std::shared_ptr<FrameQueue> frames);
  ~FoxgloveLiveSession() override;

  using FoxgloveSession::addChannels;
  using FoxgloveSession::removeChannels;
  /// Returns ROS time, which the client has been told then.
  ros::Time tellTime();

 private:
  void begin(const FoxgloveSubscription& subscription, const FoxgloveChannel& channel) override;
  void end(std::uint32_t subscription) override { subscribers_.erase(subscription); }
  FoxgloveParameters parameters() override;
  void pass(std::uint32_t subscription, const topic_tools::ShapeShifter& message);

  const std::shared_ptr<FoxgloveLive> live_;
  std::mutex told_mutex_;  ///< the next two
  ros::Time told_;
  ros::SteadyTime lost_;  ///< the time at which the client was told that messages were lost
  /// Only the queue of frames drops messages, and says so.
  ImmediateCallbacks immediately_;
  std::map<std::uint32_t, ros::Subscriber> subscribers_;  ///< last: their callbacks use the rest
};

}  // namespace afterglow::nodes
