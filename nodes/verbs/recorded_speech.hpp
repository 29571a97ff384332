/// \file
/// What a recorded behavior said aloud, and what it was asked, made again for a film of it.
#pragma once

#include <sound_play/SoundRequest.h>

#include <optional>
#include <string>
#include <vector>

#include "nodes/speaker/speech.hpp"
#include "nodes/speaker/speech_log.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// The sentences that were asked of sound_play, spoken again, and the questions of recorded goals
/// of ask_node, in another voice. They sound from the moment of their recording.
class RecordedSpeech {
 public:
  /// Keeps sounds and speech.json in the folder, which is there and empty. Throws
  /// replay::StoreError, and std::runtime_error if the folder cannot be written.
  RecordedSpeech(const replay::Store& store, const replay::Behavior& behavior,
                 const std::string& folder);

  /// Returns the sentence that sounds then, of several the latest; "" where there is none.
  std::string saidAt(replay::Stamp moment) const;
  /// Returns the question that was asked last until then; "" where there is none.
  std::string askedAt(replay::Stamp moment) const;
  /// Returns all that is to be heard, with its files.
  std::vector<Utterance> heard() const;
  /// The reason why sentences are shown and not heard, one line; empty: all is heard.
  const std::string& problem() const { return problem_; }

 private:
  void listen(const replay::Store& store, const replay::Behavior& behavior);
  void take(replay::Stamp moment, const sound_play::SoundRequest& request);
  void speak(Utterance& utterance);

  const std::string folder_;
  std::string problem_;
  SpeechLog log_;
  std::optional<Speech> speech_;                   ///< made for the first sentence
  std::vector<Utterance> utterances_, questions_;  ///< in the order of their onsets
};

}  // namespace afterglow::nodes
