/// \file
/// The programs that speak: eSpeak NG, and voices that are more pleasant than its own, where
/// somebody has installed them: SVOX Pico's (pico2wave), and MBROLA's, which eSpeak NG drives.
/// Debian has neither in main.
#pragma once

#include <string>

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

}  // namespace afterglow::nodes
