/// \file
/// Puts world-anchored light in place on a running robot: publishes the recorded frames on /tf, and
/// knows whether today's tf has the anchor.
#pragma once

#include <tf2_msgs/TFMessage.h>

#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "nodes/player/world_anchor.hpp"
#include "nodes/tools/callback_thread.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {

/// Topics: out /tf, frames `recorded/...` only; in /tf and /tf_static, until the anchor is seen.
/// While it is not, messages that need it are refused: their light would be anywhere.
class AnchorBroadcast : public replay::MessageAnchor {
 public:
  /// The recorded moment that is played, and the stamp for its transforms.
  struct Moment {
    replay::Stamp recorded, now;
  };
  /// Empty while nothing plays.
  using Position = std::function<std::optional<Moment>()>;

  /// Everything given must outlive this. The frames in use are published 30 times a second, also
  /// while the replay is paused.
  AnchorBroadcast(const replay::Store& store, const replay::PlayPlan& plan,
                  const replay::AnchorSettings& settings, Position position);

  /// False at the deadline or when `is_stopped`.
  bool waitForAnchor(Deadline deadline, const std::function<bool()>& is_stopped) const {
    return waitUntil(deadline, is_stopped, [this] { return has_anchor_.load(); });
  }
  /// Throws std::runtime_error, one line, for what cannot be anchored.
  void anchor(const replay::Channel& channel, replay::Stamp received,
              const replay::PublishMoment& moment, replay::Bytes& bytes) override;
  /// Returns notes for the report.
  std::vector<std::string> notes() const { return world_.notes(); }

 private:
  using Event = ros::MessageEvent<const tf2_msgs::TFMessage>;
  void onTransforms(const Event& event);
  void publish(const tf2_msgs::TFMessage& transforms);
  void onTimer();

  const std::string anchor_;  ///< today's name of the anchor
  const Position position_;
  std::atomic<bool> has_anchor_{false};
  WorldAnchor world_;
  ros::NodeHandle node_;
  ros::Publisher publisher_;
  CallbackThread thread_;
};

}  // namespace afterglow::nodes
