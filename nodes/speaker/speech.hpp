/// \file
/// Text into sound, through eSpeak NG, or a more pleasant voice that is installed.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "nodes/speaker/better_voice.hpp"
#include "nodes/speaker/sound.hpp"

namespace afterglow::nodes {

struct SpeechOptions {
  std::string voice = "en-us";  ///< where a request names none
  int words_per_minute = 160;   ///< 80..450; pico2wave has a pace of its own
  /// Where a request names none, too: chooseEngine().
  std::string engine = "espeak";
};

/// Keeps the sound of each sentence, so that a sentence said again starts at once. eSpeak NG has
/// one state for the whole process: use all instances from one thread.
class Speech {
 public:
  /// Throws std::runtime_error if eSpeak NG's data are missing, the default voice is unknown, or
  /// the engine is not installed.
  explicit Speech(const SpeechOptions& options = {});

  /// The sentence, mono, from its first audible sample to its last. Festival's voice names
  /// ("voice_kal_diphone" is what sound_play's clients send) and "" mean the default voice. For a
  /// voice that is not installed another one of its language stands in ("en+f3" for "en-gb+f3"). Throws
  /// std::runtime_error naming the voice that eSpeak NG does not know, or the text that is too long
  /// or has nothing in it to say.
  std::shared_ptr<const Sound> say(const std::string& text, const std::string& voice = "");

  /// Whose voice it is where a request names none: "eSpeak NG, voice en-us".
  std::string defaultVoice() const;

 private:
  std::string knownVoice(const std::string& requested);
  Sound synthesize(const std::string& text, const std::string& voice);

  SpeechOptions options_;
  SpeechEngine engine_;
  int sample_rate_ = 0;
  std::map<std::pair<std::string, std::string>, std::shared_ptr<const Sound>> said_;
};

}  // namespace afterglow::nodes
