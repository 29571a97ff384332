/// \file
/// Text into sound, by eSpeak NG or a more pleasant voice that is installed: programs that run for
/// each new sentence, some 30 ms. Whoever wants it to sound at a moment tells it ahead.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "nodes/speaker/better_voice.hpp"
#include "nodes/speaker/sound.hpp"

namespace afterglow::nodes {

struct SpeechOptions {
  std::string voice = "en-us";  ///< voice where a request names none
  int words_per_minute = 160;   ///< 80..450; pico2wave has a pace of its own
  std::string engine = "espeak";  ///< engine where a request names no voice, too: chooseEngine()
};

/// Keeps the sound of each sentence, so that a sentence said again starts at once. Of one thread.
class Speech {
 public:
  /// Throws std::runtime_error if eSpeak NG or the engine is not installed, or the default voice is
  /// unknown.
  explicit Speech(const SpeechOptions& options = {});

  /// The sentence, mono, from its first audible sample to its last. Festival's voice names
  /// ("voice_kal_diphone" is what sound_play's clients send) and "" mean the default voice. For a
  /// voice that is not installed another one of its language stands in ("en+f3" for "en-gb+f3").
  /// Throws std::runtime_error naming the voice that eSpeak NG does not know, or the text that is
  /// too long or has nothing in it to say.
  std::shared_ptr<const Sound> say(const std::string& text, const std::string& voice = "");

  /// Returns the voice where a request names none: "eSpeak NG, voice en-us".
  std::string defaultVoice() const;

 private:
  std::string knownVoice(const std::string& requested);
  Sound synthesize(const std::string& text, const std::string& voice);

  SpeechOptions options_;
  SpeechEngine engine_;
  std::map<std::string, std::string> voices_;  ///< voices that speak, by those that were asked for
  std::map<std::pair<std::string, std::string>, std::shared_ptr<const Sound>> said_;
};

}  // namespace afterglow::nodes
