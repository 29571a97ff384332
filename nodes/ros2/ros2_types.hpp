/// \file
/// Definitions of the types that nodes of ROS 2 use, as these nodes tell them, or this machine's
/// ROS 2.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "nodes/ros2/dds_service.hpp"

namespace afterglow::nodes {

/// Asks nodes, each once for a type. One thread calls.
class Ros2Types {
 public:
  /// `on_answer` is called in a thread of DDS once find() may know more.
  Ros2Types(DdsParticipant& participant, std::function<void()> on_answer);

  /// The definition of the endpoint's type, `type` ("geometry_msgs/msg/Twist"), as Ros2Topic reads
  /// it: told by the endpoint's node, else by the .msg files that AMENT_PREFIX_PATH names; empty:
  /// by neither. No value as long as the node may still answer. `all`: the graph.
  std::optional<std::string> find(const std::string& type, const DdsEndpoint& endpoint,
                                  const std::vector<DdsEndpoint>& all);

 private:
  /// A type, asked of a participant: of all its nodes, one after the other.
  using Key = std::pair<std::string, DdsGuid>;
  struct Question {
    std::chrono::steady_clock::time_point end;  ///< of the patience
    std::set<std::string> asked;                ///< services
    std::unique_ptr<DdsServiceClient> client;
    bool is_sent = false;
  };

  std::optional<std::string> told(const std::string& type, const std::string& hash);
  void ask(const Key& key, Question& question, const std::string& hash,
           const std::vector<DdsEndpoint>& all);
  void take(const Key& key, const std::string& hash, const replay::Bytes& reply);

  DdsParticipant& participant_;
  const std::function<void()> on_answer_;
  std::set<Key> silent_;  ///< not answered in time, or by no node
  std::mutex answers_mutex_;
  std::map<std::pair<std::string, std::string>, std::string> told_;  ///< by type and hash
  std::set<Key> refused_;              ///< the node that was asked last does not know it
  std::map<Key, Question> questions_;  ///< last: their threads use the rest
};

}  // namespace afterglow::nodes
