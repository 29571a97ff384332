/// \file
/// A player as its guard knows it, and the messages of any type that stop its robot. C++14
/// (guard_messages.hpp).
#pragma once

#include <ros/ros.h>

#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "nodes/guard/guard_messages.hpp"
#include "replay/motion/stops/heartbeat.hpp"

namespace afterglow {
namespace nodes {

/// A message of a type that is known at run time only, for roscpp to publish: topic_tools'
/// ShapeShifter without topic_tools.
struct StopMessage {
  std::string type, md5sum, definition;
  std::vector<std::uint8_t> bytes;
};

}  // namespace nodes
}  // namespace afterglow

namespace ros {
namespace message_traits {

template <>
struct IsMessage<afterglow::nodes::StopMessage> : TrueType {};
template <>
struct IsMessage<const afterglow::nodes::StopMessage> : TrueType {};

template <>
struct MD5Sum<afterglow::nodes::StopMessage> {
  static const char* value() { return "*"; }
  static const char* value(const afterglow::nodes::StopMessage& message) {
    return message.md5sum.c_str();
  }
};

template <>
struct DataType<afterglow::nodes::StopMessage> {
  static const char* value() { return "*"; }
  static const char* value(const afterglow::nodes::StopMessage& message) {
    return message.type.c_str();
  }
};

template <>
struct Definition<afterglow::nodes::StopMessage> {
  static const char* value() { return ""; }
  static const char* value(const afterglow::nodes::StopMessage& message) {
    return message.definition.c_str();
  }
};

}  // namespace message_traits

namespace serialization {

template <>
struct Serializer<afterglow::nodes::StopMessage> {
  template <typename Stream>
  static void write(Stream& stream, const afterglow::nodes::StopMessage& message) {
    const std::uint32_t size = serializedLength(message);
    if (size > 0) std::memcpy(stream.advance(size), message.bytes.data(), size);
  }
  static std::uint32_t serializedLength(const afterglow::nodes::StopMessage& message) {
    return static_cast<std::uint32_t>(message.bytes.size());
  }
};

}  // namespace serialization
}  // namespace ros

namespace afterglow {
namespace nodes {

/// The way of the stops of one output to the robot: a topic of ROS 1, or what another graph has in
/// its place.
class StopWay {
 public:
  StopWay() = default;
  virtual ~StopWay() = default;
  StopWay(const StopWay&) = delete;
  StopWay& operator=(const StopWay&) = delete;

  virtual std::uint32_t heardBy() const = 0;
  /// Does not throw.
  virtual void publish(const StopMessage& stop) = 0;
  /// Returns why nothing may move that is stopped here: a clause. Empty: it may.
  virtual std::string objection() const { return ""; }
};

/// A player's life, its motion and its stops: in the watchdog beside it and in the guard on the
/// robot alike. Times are replay::sinceBoot(). One thread at a time.
class GuardedPlayer {
 public:
  /// Ways by topic.
  using Ways = std::map<std::string, std::shared_ptr<StopWay>>;

  /// `is_beside`: on this machine, in the same network; else its outputs say where it is.
  explicit GuardedPlayer(bool is_beside = false)
      : watch_(replay::HeartbeatMonitor::Options()), is_beside_(is_beside) {}

  /// A publisher for every output; those that are known already are kept. Asks the master, which
  /// may take long.
  static Ways advertise(ros::NodeHandle& node, const GuardOutputs& outputs, const Ways& known);
  void know(const GuardOutputs& outputs, const Ways& ways, replay::SteadyTime now);
  const Ways& ways() const { return ways_; }
  const std::string& name() const { return name_; }
  std::uint32_t version() const { return version_; }

  /// Hears a beat, which has to be answered.
  void hear(const GuardBeat& beat, replay::SteadyTime now);
  GuardAnswer answer() const;

  /// The robot has to stop, for another reason than the player's silence. Nothing if it stands.
  void stop(replay::SteadyTime now, const std::string& reason) { watch_.stop(now, reason); }
  /// Publishes the stops that are due; called after each of these, and at deadline(). Returns true
  /// when it has begun to stop the robot.
  bool step(replay::SteadyTime now);
  replay::SteadyTime deadline() const { return watch_.deadline(); }
  bool isBraking() const;
  /// Returns true if it has ended, or what it had in motion was stopped.
  bool isOver() const { return watch_.isOver(); }
  /// Returns what was done: a sentence, "why: the robot is being stopped".
  std::string account() const;
  /// Returns true if it has ended, or has not been heard of for long.
  bool isGone(replay::SteadyTime now) const;

 private:
  replay::HeartbeatMonitor watch_;
  bool is_beside_;
  std::uint64_t id_ = 0;
  std::string name_;
  std::uint32_t version_ = 0;
  Ways ways_;
  std::vector<std::pair<std::string, StopMessage>> stops_;  ///< topic and stop of each output
  std::set<std::string> heard_;  ///< topics whose stop somebody heard, at least once
  replay::Outputs stopped_;
  GuardBeat last_;  ///< the last beat that was heard
  replay::SteadyTime last_heard_;
  std::int64_t longest_gap_ns_ = 0, patience_ns_ = 0;
};

}  // namespace nodes
}  // namespace afterglow
