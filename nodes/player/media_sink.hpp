/// \file
/// Makes the sounds and meshes of a recording work on this machine: files that are not here come
/// from the store, and sound requests are brought to today's definition.
///
/// Prepares this robot for the light and the speech of a replay: anchors the light to its recorded
/// place, finds sounds and meshes, and tells the speaker which sentences will come.
#pragma once

#include <sound_play/SoundRequest.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nodes/player/world_anchor.hpp"
#include "nodes/tools/callback_thread.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/play/outbox.hpp"
#include "replay/record/file_references.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Old definitions of sound_play/SoundRequest in the plan's outputs become today's, which is what
/// sound_play listens to. Before a sink is made of the plan.
void renewSpeechOutputs(replay::PlayPlan& plan);

/// The sentences that a replay will ask for, in order, each once; the first 60. Throws StoreError.
std::vector<sound_play::SoundRequest> sentencesOf(const replay::Store& store,
                                                  const replay::PlayPlan& plan);

/// Stands between a player and the sink it publishes on; everything given must outlive it.
class MediaSink : public replay::MessageSink {
 public:
  /// Writes the files that the behavior has kept and this machine lacks to `cache_folder`, by their
  /// SHA-256; "": $XDG_CACHE_HOME or ~/.cache, afterglow/files. What cannot be had is noted, and
  /// the rest goes on. Throws StoreError.
  MediaSink(const replay::Store& store, const replay::PlayPlan& plan, replay::MessageSink& sink,
            std::string cache_folder = "");

  bool publish(const replay::Channel& channel, const replay::Bytes& bytes) override;
  /// Makes requests name voices that sound_play has (soundPlayVoice) from now on.
  void speakThroughSoundPlay() { has_sound_play_ = true; }

  /// The notes for the report: what came from the store, what is lost.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  struct Topic {
    replay::Channel recorded;
    std::unique_ptr<replay::FileReferences> references;  ///< references by the output's definition
  };

  void fetchFiles(const replay::Store& store, const replay::Behavior& behavior);
  std::string fetch(const replay::Store& store, const std::string& uri, const std::string& sha256);
  std::string replacementFor(const std::string& uri);
  void renameVoice(sound_play::SoundRequest& request);

  replay::MessageSink& sink_;
  std::string cache_folder_;
  std::map<std::string, Topic> topics_;              ///< topics by output name
  std::map<std::string, std::string> replacements_;  ///< URIs; "": it is here, or nowhere
  std::vector<std::string> notes_;
  bool has_sound_play_ = false;
  std::set<std::string> renamed_voices_;
};

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
