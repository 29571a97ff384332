/// \file
/// A piece of sound in memory, and sound files.
#pragma once

#include <cstdint>
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

}  // namespace afterglow::nodes
