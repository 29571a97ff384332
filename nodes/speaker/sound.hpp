/// \file
/// Sounds in memory, sound files, and SoundRequest's built-in sounds, which are made here because
/// sound_play's own files come with sound_play.
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

}  // namespace afterglow::nodes
