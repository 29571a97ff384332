/// \file
/// Prepares this robot for the light and the speech of a replay: anchors the light to its recorded
/// place, finds sounds and meshes, and tells the speaker which sentences will come.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nodes/player/media_sink.hpp"
#include "nodes/player/world_anchor.hpp"
#include "nodes/tools/callback_thread.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {

/// Topics, for speech on /robotsound: out /robotsound/ahead (sound_play/SoundRequest), in
/// /robotsound/problem (std_msgs/String), both speaker_node's. Everything given must outlive it.
class MediaPreparation {
 public:
  /// The anchor settings for a plan: where the recording's own tf is played, no light is anchored,
  /// because the recorded frames are where they were.
  static replay::AnchorSettings anchorsIn(const replay::PlayPlan& plan,
                                          const replay::AnchorSettings& settings);
  /// Makes a plan fit for here: refuses topics whose light cannot be placed (WorldAnchor), brings
  /// speech to today's definition. Returns whether today's tf has to know the anchor.
  static bool fit(const replay::Store& store, replay::PlayPlan& plan,
                  const replay::AnchorSettings& settings);

  MediaPreparation(const replay::Store& store, const replay::PlayPlan& plan,
                   const replay::AnchorSettings& settings, replay::MessageSink& sink,
                   AnchorBroadcast::Position position);

  /// Waits at most 2 s for the anchor, if any light needs it, and for the speaker, if one is there.
  void prepare(const std::function<bool()>& is_stopped);

  replay::MessageSink& sink() { return media_; }
  replay::MessageAnchor* anchor() { return anchor_ ? &*anchor_ : nullptr; }
  /// Tells from now on when speech is lost, in a thread of its own; also of what was already lost,
  /// if the speaker still says so.
  void listen(std::function<void(const std::string& problem)> on_speech_lost);
  /// Returns notes for the report. To be called once; listen()'s callback is not called after it.
  std::vector<std::string> notes();

 private:
  void onProblem(const std::string& problem);
  void tellAhead(Deadline deadline, const std::function<bool()>& is_stopped);

  const replay::Store& store_;
  const replay::PlayPlan& plan_;
  const bool needs_anchor_;
  MediaSink media_;
  std::optional<AnchorBroadcast> anchor_;  ///< if any topic is anchored to the world
  std::string speech_topic_;               ///< empty: nothing is said
  ros::NodeHandle node_;
  ros::Publisher ahead_;
  std::set<std::string> heard_problems_;
  std::function<void(const std::string&)> on_speech_lost_;
  CallbackThread thread_;
};

}  // namespace afterglow::nodes
