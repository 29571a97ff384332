/// \file
/// Keeps recorded light on the spot of the world where it was, though robot and projector have
/// moved since: frames named by a message become `recorded/FRAME`, and today's tf gets the recorded
/// transforms of those frames from the anchor (map). The rest of a message stays as it is, so every
/// type with headers works.
#pragma once

#include <tf2_msgs/TFMessage.h>

#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "nodes/player/recorded_frames.hpp"
#include "replay/plan/anchoring.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

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

}  // namespace afterglow::nodes
