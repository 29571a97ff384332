/// \file
/// Makes the sounds and meshes of a recording work on this machine: files that are not here come
/// from the store, and sound requests are brought to today's definition.
#pragma once

#include <sound_play/SoundRequest.h>

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

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

}  // namespace afterglow::nodes
