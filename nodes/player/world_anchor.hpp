/// \file
/// Keeps recorded light on the spot of the world where it was, though robot and projector have
/// moved since: frames named by a message become `recorded/FRAME`, and today's tf gets the recorded
/// transforms of those frames from the anchor (map). The rest of a message stays as it is, so every
/// type with headers works.
#pragma once

#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nodes/tools/callback_thread.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/plan/anchoring.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// The recorded transforms of a behavior, from its recording's /tf and /tf_static. Reads along as
/// later moments are asked for, and anew where it is far from them: memory is that of half a minute
/// of tf. Keeps a reference to the store. No ROS master is involved; one thread at a time.
class RecordedFrames {
 public:
  RecordedFrames(const replay::Store& store, const replay::Behavior& behavior, std::string anchor);

  /// The kinds of transforms that will do.
  enum class Wanted {
    Exact,  ///< a transform between two that were recorded
    Newest  ///< also the newest before, if it is at most 2 s older
  };
  /// T_anchor_frame at a moment of the robot's clock then. Empty if it was not recorded. Throws
  /// replay::StoreError.
  std::optional<Eigen::Isometry3d> at(const std::string& frame, replay::Stamp moment,
                                      Wanted wanted);
  /// Reads ahead, so that at() finds transforms until this moment without reading.
  void readTo(replay::Stamp moment);

  const std::string& anchor() const { return anchor_; }

 private:
  void restart(replay::Stamp moment);
  std::vector<std::string> withOwn(const std::string& topic) const;
  bool read();
  void feed(const replay::Message& message, bool is_static);
  std::optional<Eigen::Isometry3d> look(const std::string& frame, replay::Stamp moment) const;

  const replay::Store& store_;
  replay::Behavior behavior_;
  const std::string anchor_;
  const replay::RobotNames robot_;
  tf2::BufferCore buffer_;
  std::unique_ptr<replay::MessageCursor> cursor_;  ///< cursor; empty: nothing comes any more
  replay::Stamp begin_, read_to_;                  ///< span that the buffer holds
};

/// Anchors messages in the world: each is preceded by the transforms at its own stamps; a message
/// without a stamp, which means "where the frame is now", gets one. Frames without a recorded
/// transform are not published: their light stays off. Store and plan must outlive this. Any
/// thread.
class WorldAnchor : public replay::MessageAnchor {
 public:
  using Publish = std::function<void(const tf2_msgs::TFMessage&)>;

  WorldAnchor(const replay::Store& store, const replay::PlayPlan& plan,
              replay::AnchorSettings settings, Publish publish);

  /// Refuses, in the plan, world-anchored topics of which nothing can be placed: by the first frame
  /// they name. True if there are topics left that need the anchor in today's tf.
  static bool refuseUnplaced(const replay::Store& store, replay::PlayPlan& plan,
                             const replay::AnchorSettings& settings);

  /// Throws replay::MessageError, StoreError.
  void anchor(const replay::Channel& channel, replay::Stamp received,
              const replay::PublishMoment& moment, replay::Bytes& bytes) override;
  /// Tells where the frames in use are at a recorded moment: to be repeated, also while paused, for
  /// what follows its frame.
  void repeat(replay::Stamp recorded, replay::Stamp now);
  /// Reads the recording's transforms from there on, as repeat() does: the scheduler, whose
  /// messages are to be on time, seldom has to then.
  void readAhead(replay::Stamp recorded);
  /// Returns a line for each frame that could not be placed.
  std::vector<std::string> notes() const;

 private:
  const replay::HeaderFields& fieldsOf(const replay::Channel& channel);
  void place(const std::string& frame, replay::Stamp moment, RecordedFrames::Wanted wanted,
             replay::Stamp published, tf2_msgs::TFMessage& transforms);

  const replay::PlayPlan& plan_;
  const replay::AnchorSettings settings_;
  const Publish publish_;
  mutable std::mutex mutex_;
  RecordedFrames recorded_;
  std::map<std::string, replay::HeaderFields> fields_;  ///< header fields by md5 and type
  std::set<std::string> frames_;                        ///< frames in use
  std::map<std::string, std::uint64_t> unplaced_;       ///< counts by frame
  std::map<std::string, replay::Stamp> told_;           ///< the last stamp told, by frame
  replay::Stamp last_stamped_;
};

/// Puts world-anchored light in place on a running robot. Topics: out /tf, frames `recorded/...`
/// only; in /tf and /tf_static, until the anchor is seen. While it is not, messages that need it
/// are refused: their light would be anywhere.
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
