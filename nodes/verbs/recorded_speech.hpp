/// \file
/// What a recorded behavior said aloud, and what it was asked, made again for a film of it.
///
/// The messages of one type that were recorded with a behavior.
#pragma once

#include <sound_play/SoundRequest.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "nodes/conversion/typed_message.hpp"
#include "nodes/speaker/sound.hpp"
#include "nodes/speaker/speech.hpp"
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

/// Calls `visit` for each of them in order, its context's, too; those that cannot be read are left
/// out. Throws replay::StoreError.
template <typename MessageType>
void eachRecorded(const replay::Store& store, const replay::Behavior& behavior,
                  const std::function<void(replay::Stamp, const MessageType&)>& visit) {
  namespace traits = ros::message_traits;
  replay::MessageRange range;
  for (const auto& known : {store.topics(behavior), store.contextTopics(behavior)}) {
    for (const replay::TopicSummary& topic : known) {
      if (topic.type == traits::DataType<MessageType>::value()) range.topics.push_back(topic.topic);
    }
  }
  if (range.topics.empty()) return;
  const auto cursor = store.messages(behavior, range);
  while (const auto message = cursor->next()) {
    const auto typed = toMessage<MessageType>(message->bytes);
    if (typed) visit(message->received, *typed);
  }
}

}  // namespace afterglow::nodes
