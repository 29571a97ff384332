/// \file
/// The way between a player and the watchdog beside it: the messages of guard_messages.hpp on a
/// socket that keeps them whole and shows either side when the other is gone. C++14
/// (guard_messages.hpp).
#pragma once

#include <ros/serialization.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "nodes/guard/guard_messages.hpp"

namespace afterglow {
namespace nodes {

/// Owns its file descriptor. Never blocks; one thread at a time.
class GuardSocket {
 public:
  using Packet = std::vector<std::uint8_t>;

  explicit GuardSocket(int fd) : fd_(fd) {}
  ~GuardSocket();
  GuardSocket(const GuardSocket&) = delete;
  GuardSocket& operator=(const GuardSocket&) = delete;

  /// Two ends, closed on exec. Throws std::system_error.
  static std::pair<int, int> makePair();

  /// Is lost if the other side is gone, or has not read for long.
  template <typename Message>
  void send(const Message& message) {
    const std::uint32_t size = ros::serialization::serializationLength(message);
    Packet packet(1 + size);
    packet[0] = kindOf(static_cast<const Message*>(nullptr));
    ros::serialization::OStream stream(packet.data() + 1, size);
    ros::serialization::serialize(stream, message);
    sendPacket(packet);
  }

  /// The next message that has come; empty: none, or the other side is gone.
  Packet receive();
  /// False if the packet is another kind of message. Throws
  /// ros::serialization::StreamOverrunException for one that is too short.
  template <typename Message>
  static bool read(Packet& packet, Message& message) {
    if (packet.empty() || packet[0] != kindOf(static_cast<const Message*>(nullptr))) return false;
    ros::serialization::IStream stream(packet.data() + 1,
                                       static_cast<std::uint32_t>(packet.size() - 1));
    ros::serialization::deserialize(stream, message);
    return true;
  }

  /// Waits for something to receive, the other side's end, or something to read at `other_fd` (-1:
  /// nothing).
  void wait(int timeout_ms, int other_fd) const;
  bool isClosed() const { return is_closed_; }

 private:
  static std::uint8_t kindOf(const GuardOutputs*) { return 'o'; }
  static std::uint8_t kindOf(const GuardBeat*) { return 'b'; }
  static std::uint8_t kindOf(const GuardAnswer*) { return 'a'; }
  void sendPacket(const Packet& packet);

  int fd_;
  bool is_closed_ = false;
};

}  // namespace nodes
}  // namespace afterglow
