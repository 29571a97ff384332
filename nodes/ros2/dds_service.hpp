/// \file
/// Services of ROS 2 over DDS: a topic of requests and one of replies, each reply naming its
/// request as rmw_fastrtps does it (related sample identity). Peers of rmw_cyclonedds, which name
/// it otherwise, are not understood.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>

#include "nodes/ros2/dds.hpp"

namespace afterglow::nodes {

/// Asks. Any thread.
class DdsServiceClient {
 public:
  /// `request`: of send(). Called in a thread of DDS.
  using OnReply = std::function<void(std::int64_t request, replay::Bytes&& cdr)>;

  /// Throws as DdsWriter.
  DdsServiceClient(DdsParticipant& participant, const replay::ServiceNames& names,
                   OnReply on_reply);

  /// A server is there, and can answer: what is sent before is lost.
  bool isServed() const;
  /// Returns the number of the request. Throws as DdsWriter.
  std::int64_t send(const replay::Bytes& cdr);

 private:
  const OnReply on_reply_;
  std::atomic<bool> is_complete_{false};  ///< before that, no reply is its own
  DdsWriter requests_;
  DdsReader replies_;  ///< last: its thread uses the rest
};

/// Answers. Any thread.
class DdsServiceServer {
 public:
  /// Called in a thread of DDS; the answer may be given later, from any thread.
  using OnRequest = std::function<void(const SampleIdentity& request, replay::Bytes&& cdr)>;

  /// Throws as DdsWriter.
  DdsServiceServer(DdsParticipant& participant, const replay::ServiceNames& names,
                   OnRequest on_request);

  /// Waits a moment for a client that is not yet known to listen. Throws as DdsWriter.
  void reply(const SampleIdentity& request, const replay::Bytes& cdr);
  /// Takes no request more. Waits for the call under way.
  void deafen() { requests_.reset(); }

 private:
  const OnRequest on_request_;
  DdsWriter replies_;
  std::unique_ptr<DdsReader> requests_;  ///< last: its thread uses the rest
};

}  // namespace afterglow::nodes
