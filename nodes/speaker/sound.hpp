/// \file
/// Sounds in memory, sound files, and SoundRequest's built-in sounds, which are made here because
/// sound_play's own files come with sound_play.
///
/// The record of what was heard and when: a folder with a WAV file for every utterance and
/// `speech.json`, a JSON array of {text, voice, onset_ns, duration_s, volume, loop, file}.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace afterglow::nodes {

/// 16-bit samples, channels interleaved.
struct Sound {
  int sample_rate = 0;  ///< Hz
  int channels = 1;
  std::vector<std::int16_t> samples;

  double seconds() const;
};

/// Reads a WAV file of any sample format. Throws std::runtime_error naming the path and what is
/// wrong: not there, not a regular file, not a WAV file, no sound in it, longer than ten minutes.
Sound readWav(const std::string& path);

/// Writes 16-bit PCM; `volume` 0..1 scales the samples. Throws std::runtime_error with the path.
void writeWav(const std::string& path, const Sound& sound, double volume = 1);

/// Returns the bytes of such a file.
std::string wavOf(const Sound& sound);

/// BACKINGUP (1) to NEEDS_PLUGGING_BADLY (5): beeps, told apart by pitch and number, and followed
/// by a rest, to be looped. Null for other numbers.
std::shared_ptr<const Sound> builtInSound(int number);

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
