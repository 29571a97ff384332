/// \file
/// The messages between a player and its guards. Written by hand, as messages of their own would
/// have to be generated on the robot as well; C++14, as its system is old.
///
/// By a socket with the watchdog beside the player (guard_socket.hpp); by topics with the guard on
/// the robot, here by the name /afterglow_guard:
/// - in: /afterglow_guard/outputs (GuardOutputs), again until it is answered;
/// - in: /afterglow_guard/beats (GuardBeat), every 20 ms;
/// - out: /afterglow_guard/answers (GuardAnswer), one for each beat.
///
/// afterglow_ros2_watch (nodes/ros2/) has the same topics by its name; its beats come over ROS 2.
#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <cstdint>
#include <string>
#include <vector>

#include "nodes/tools/next_fields.hpp"

namespace afterglow {
namespace nodes {

/// A bridge to ROS 2 is known on the graph by this topic of its own, latched: the network that it
/// joins. What it hears goes to robots that no guard on ROS 1 reaches without it.
constexpr const char* kRos2BridgeMark = "/ros2_network";

/// A topic, and the message that stops what was set in motion by a player, as its bytes.
struct GuardOutput {
  std::string topic, type, md5sum, definition;
  std::vector<std::uint8_t> stop;
};

/// All that a player may set in motion.
struct GuardOutputs {
  std::uint64_t player = 0;   ///< drawn at random for each replay
  std::string name;           ///< name of its node
  std::string machine;        ///< machineName()
  std::uint32_t version = 0;  ///< counted up whenever one of them has changed
  std::vector<GuardOutput> outputs;
};

/// The player lives.
struct GuardBeat {
  std::uint64_t player = 0;
  std::uint32_t count = 0;        ///< number of the beat, from 1
  std::uint64_t sent_ns = 0;      ///< replay::sinceBoot() of the player's machine
  std::uint32_t patience_ms = 0;  ///< longer silence in motion means that the player is gone
  std::uint8_t stop = 0;          ///< 1: stop the robot now; what moves is known
  std::uint8_t end = 0;           ///< 1: all is over, and the robot stands
  std::vector<std::uint32_t> moving;  ///< places in GuardOutputs::outputs
};

/// The guard lives.
struct GuardAnswer {
  std::uint64_t player = 0;
  std::uint32_t count = 0;           ///< the last beat that was heard
  std::uint32_t version = 0;         ///< version of the outputs that it can stop; 0: none
  std::uint32_t longest_gap_us = 0;  ///< gap between two beats as they were heard, so far
  std::uint32_t patience_ms = 0;     ///< patience in force: over a network at most a second
  std::uint8_t is_beside = 0;        ///< 1: on the player's machine, in the same network
  std::string stopped;               ///< the reason why it stopped the robot; empty: it did not
  std::vector<std::uint32_t> heard_by;  ///< number of listeners to each output's stop
};

}  // namespace nodes
}  // namespace afterglow

/// The traits by which roscpp knows a message. The MD5 sums are those of the definitions, as genmsg
/// computes them.
#define AFTERGLOW_GUARD_MESSAGE(Message, Md5, Text)                                          \
  template <>                                                                                \
  struct IsMessage<afterglow::nodes::Message> : TrueType {};                                 \
  template <>                                                                                \
  struct IsMessage<const afterglow::nodes::Message> : TrueType {};                           \
  template <>                                                                                \
  struct MD5Sum<afterglow::nodes::Message> {                                                 \
    static const char* value() { return Md5; }                                               \
    static const char* value(const afterglow::nodes::Message&) { return value(); }           \
  };                                                                                         \
  template <>                                                                                \
  struct DataType<afterglow::nodes::Message> {                                               \
    static const char* value() { return "afterglow/" #Message; }                             \
    static const char* value(const afterglow::nodes::Message&) { return value(); }           \
  };                                                                                         \
  template <>                                                                                \
  struct Definition<afterglow::nodes::Message> {                                             \
    static const char* value() { return Text; }                                              \
    static const char* value(const afterglow::nodes::Message&) { return value(); }           \
  };

namespace ros {
namespace message_traits {

AFTERGLOW_GUARD_MESSAGE(GuardOutputs, "fd58da81b23a4121ac5c526ea422d09a",
                        "uint64 player\n"
                        "string name\n"
                        "string machine\n"
                        "uint32 version\n"
                        "GuardOutput[] outputs\n"
                        "\n"
                        "======================================================================"
                        "==========\n"
                        "MSG: afterglow/GuardOutput\n"
                        "string topic\n"
                        "string type\n"
                        "string md5sum\n"
                        "string definition\n"
                        "uint8[] stop\n")
AFTERGLOW_GUARD_MESSAGE(GuardBeat, "af5370e73e44f51020adaf49064724f4",
                        "uint64 player\n"
                        "uint32 count\n"
                        "uint64 sent_ns\n"
                        "uint32 patience_ms\n"
                        "bool stop\n"
                        "bool end\n"
                        "uint32[] moving\n")
AFTERGLOW_GUARD_MESSAGE(GuardAnswer, "9b22b42136becae996e6976b447dbe71",
                        "uint64 player\n"
                        "uint32 count\n"
                        "uint32 version\n"
                        "uint32 longest_gap_us\n"
                        "uint32 patience_ms\n"
                        "bool is_beside\n"
                        "string stopped\n"
                        "uint32[] heard_by\n")

}  // namespace message_traits

namespace serialization {

AFTERGLOW_SERIALIZED(afterglow::nodes::GuardOutput, message.topic, message.type, message.md5sum,
                     message.definition, message.stop)
AFTERGLOW_SERIALIZED(afterglow::nodes::GuardOutputs, message.player, message.name,
                     message.machine, message.version, message.outputs)
AFTERGLOW_SERIALIZED(afterglow::nodes::GuardBeat, message.player, message.count, message.sent_ns,
                     message.patience_ms, message.stop, message.end, message.moving)
AFTERGLOW_SERIALIZED(afterglow::nodes::GuardAnswer, message.player, message.count,
                     message.version, message.longest_gap_us, message.patience_ms,
                     message.is_beside, message.stopped, message.heard_by)

}  // namespace serialization
}  // namespace ros
