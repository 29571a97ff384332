/// \file
/// A silent video and what was said while it was filmed, as one video with sound.
#pragma once

#include <string>

namespace afterglow::nodes {

/// Writes `output` (MP4: the pictures as they are, AAC sound, playable while it loads): every sound
/// of `speech_log` (SpeechLog's speech.json) at its moment in the `video` (TimedVideo's, with its
/// VIDEO.json beside it), all of it as loud as spoken video usually is (-16 LUFS). Sounds from
/// outside the video's time are left out; without any the video stays silent.
/// `output` is either whole or untouched; it may not be `video`. Throws std::runtime_error naming
/// the file and what went wrong.
void addSpeech(const std::string& video, const std::string& speech_log, const std::string& output);

}  // namespace afterglow::nodes
