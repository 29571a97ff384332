/// \file
/// The robot's words in a behavior: sound_play/SoundRequests of any definition, on its own topics
/// and on those that were recorded beside them. Who asks for less picks from this.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// A sentence or the name of a sound's file; no order to stop one.
struct Utterance {
  Stamp at;
  std::string text;
  bool is_sentence = true;
  std::uint64_t sequence = 0;  ///< sequence number of its message
};

/// The topics of SoundRequests, its own and those of its context.
std::vector<std::string> soundTopics(const Store& store, const Behavior& behavior);

/// Calls for each utterance in order, within `begin` and `end` of the range, until `on_said`
/// returns false. A message that cannot be read is left out. Throws StoreError.
void hearUtterances(const Store& store, const Behavior& behavior, MessageRange range,
                    const std::function<bool(const Utterance&)>& on_said);

/// Returns its first `most` sentences in order. Throws StoreError.
std::vector<Utterance> sentencesIn(const Store& store, const Behavior& behavior,
                                   std::size_t most = 200);
/// The text of the first 20.
std::vector<std::string> saidIn(const Store& store, const Behavior& behavior);

}  // namespace afterglow::replay
