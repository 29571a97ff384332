/// \file
/// The record of what was heard and when: a folder with a WAV file for every utterance and
/// `speech.json`, a JSON array of {text, voice, onset_ns, duration_s, volume, loop, file}.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nodes/speaker/sound.hpp"

namespace afterglow::nodes {

struct Utterance {
  std::string text;           ///< text that was said; "" for a sound file
  std::string voice;          ///< voice as requested
  std::int64_t onset_ns = 0;  ///< ROS time at which it began to sound
  double duration_s = 0;      ///< duration of the sound: less than the file if it was stopped
  double volume = 1;          ///< 0..1
  bool loop = false;          ///< the file was repeated for duration_s
  std::string file;           ///< WAV; relative to the folder in the JSON, a whole path in memory
};

/// Reads a speech.json. Throws std::runtime_error naming the file and what is wrong in it.
std::vector<Utterance> readSpeechLog(const std::string& path);

/// Goes on with what the folder already holds. The JSON is replaced as a whole at every change: it
/// can be read at any time. Throws std::runtime_error with the path.
class SpeechLog {
 public:
  explicit SpeechLog(std::string folder);

  /// Writes the WAV file (`utterance.file` is ignored) and the entry; its place in the array.
  std::size_t add(Utterance utterance, const Sound& sound);
  void setDuration(std::size_t index, double duration_s);

 private:
  void save() const;

  std::string folder_;
  std::vector<Utterance> utterances_;
};

}  // namespace afterglow::nodes
