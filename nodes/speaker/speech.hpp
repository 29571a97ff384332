/// \file
/// Text into sound, by eSpeak NG or a more pleasant voice that is installed: programs that run for
/// each new sentence, some 30 ms. Whoever wants it to sound at a moment tells it ahead.
/// The programs that speak: eSpeak NG, and voices that are more pleasant than its own, where
/// somebody has installed them: SVOX Pico's (pico2wave), and MBROLA's, which eSpeak NG drives.
/// Debian has neither in main.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "nodes/speaker/sound.hpp"

namespace afterglow::nodes {

/// The engine that speaks where a request names no voice.
enum class SpeechEngine { Pico, Mbrola, Espeak };

/// `wanted`: "pico", "mbrola", "espeak"; "" or "auto": the first of these that is installed, for a
/// voice in English. Throws std::runtime_error for another word, and for what is not installed.
SpeechEngine chooseEngine(const std::string& wanted, const std::string& voice);

/// eSpeak NG's name of an installed voice of MBROLA, such as "mb-us1"; empty: there is none.
std::string mbrolaVoice();

/// Returns true if eSpeak NG has a voice of that name. Throws std::runtime_error if eSpeak NG is
/// not installed.
bool hasEspeakVoice(const std::string& voice);

/// Speaks by eSpeak NG. Throws std::runtime_error if the program fails.
Sound sayByEspeak(const std::string& text, const std::string& voice, int words_per_minute);
/// Speaks by pico2wave, in the English of that voice ("en-gb..." British, otherwise American).
/// Throws std::runtime_error if the program fails.
Sound sayByPico(const std::string& text, const std::string& voice);

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
