#include "nodes/speaker/sound.hpp"

#include <cmath>
#include <filesystem>
#include <sndfile.hh>
#include <stdexcept>

namespace afterglow::nodes {
namespace {

constexpr double kLongest_s = 600;  // keeps a stray file from filling the memory

}  // namespace

double Sound::seconds() const {
  if (sample_rate <= 0 || channels <= 0) return 0;
  return static_cast<double>(samples.size()) / channels / sample_rate;
}

Sound readWav(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw std::runtime_error(path + ": no such file");
  }
  SndfileHandle file(path);
  if (file.error() != SF_ERR_NO_ERROR) throw std::runtime_error(path + ": " + file.strError());
  const int container = file.format() & SF_FORMAT_TYPEMASK;
  if (container != SF_FORMAT_WAV && container != SF_FORMAT_WAVEX) {
    throw std::runtime_error(path + ": not a WAV file");
  }
  if (static_cast<double>(file.frames()) > kLongest_s * file.samplerate()) {
    throw std::runtime_error(path + ": longer than ten minutes");
  }
  Sound sound{file.samplerate(), file.channels(), {}};
  sound.samples.resize(static_cast<std::size_t>(file.frames() * file.channels()));
  const sf_count_t frames = file.readf(sound.samples.data(), file.frames());
  sound.samples.resize(static_cast<std::size_t>(frames * file.channels()));
  if (sound.samples.empty()) throw std::runtime_error(path + ": no sound in it");
  return sound;
}

void writeWav(const std::string& path, const Sound& sound, double volume) {
  SndfileHandle file(path, SFM_WRITE, SF_FORMAT_WAV | SF_FORMAT_PCM_16, sound.channels,
                     sound.sample_rate);
  std::vector<std::int16_t> scaled(sound.samples);
  for (std::int16_t& sample : scaled) {
    sample = static_cast<std::int16_t>(std::lround(sample * volume));
  }
  const auto count = static_cast<sf_count_t>(scaled.size());
  if (file.error() != SF_ERR_NO_ERROR || file.write(scaled.data(), count) != count) {
    throw std::runtime_error(path + ": cannot write: " + file.strError());
  }
}

}  // namespace afterglow::nodes
