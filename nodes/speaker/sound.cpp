#include "nodes/speaker/sound.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sndfile.hh>
#include <stdexcept>
#include <utility>
#include <vector>

#include "calib/file_replacement.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kLongest_s = 600;  // keeps a stray file from filling the memory

constexpr int kRate = 22050;  // Hz
constexpr double kTone_s = 0.12, kGap_s = 0.08, kRest_s = 0.6, kFade_s = 0.01;
constexpr double kLoudness = 0.4;
constexpr double kTurn = 6.283185307179586;

/// Hz, one after the other. Plugging rises, unplugging falls; badly: twice.
const std::vector<double> kTones[] = {
    {1000, 1000}, {880, 587}, {587, 880}, {880, 587, 880, 587}, {587, 880, 587, 880}};

void append(Sound& sound, double hertz, double seconds) {
  const auto count = static_cast<int>(seconds * kRate);
  for (int i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / kRate;
    const double edge = std::clamp(std::min(t, seconds - t) / kFade_s, 0.0, 1.0);  // no clicks
    sound.samples.push_back(static_cast<std::int16_t>(
        std::lround(32767 * kLoudness * edge * std::sin(kTurn * hertz * t))));
  }
}

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

std::string wavOf(const Sound& sound) {
  std::string bytes = "RIFF";
  const auto put = [&bytes](std::size_t number, int size) {
    for (int i = 0; i < size; ++i) bytes += static_cast<char>(number >> (8 * i) & 0xFF);
  };
  const auto rate = static_cast<std::size_t>(sound.sample_rate);
  const auto frame = static_cast<std::size_t>(sound.channels) * sizeof(std::int16_t);
  const std::size_t size = sound.samples.size() * sizeof(std::int16_t);
  put(36 + size, 4);
  bytes += "WAVEfmt ";
  put(16, 4);
  put(1, 2);  // PCM
  put(static_cast<std::size_t>(sound.channels), 2);
  put(rate, 4);
  put(rate * frame, 4);
  put(frame, 2);
  put(16, 2);
  bytes += "data";
  put(size, 4);
  for (const std::int16_t sample : sound.samples) put(static_cast<std::uint16_t>(sample), 2);
  return bytes;
}

std::shared_ptr<const Sound> builtInSound(int number) {
  if (number < 1 || number > static_cast<int>(std::size(kTones))) return nullptr;
  auto sound = std::make_shared<Sound>(Sound{kRate, 1, {}});
  for (const double hertz : kTones[static_cast<std::size_t>(number - 1)]) {
    append(*sound, hertz, kTone_s);
    append(*sound, 0, kGap_s);
  }
  append(*sound, 0, kRest_s);
  return sound;
}

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kLogName = "speech.json";

Json toJson(const Utterance& utterance) {
  return {{"text", utterance.text},
          {"voice", utterance.voice},
          {"onset_ns", utterance.onset_ns},
          {"duration_s", utterance.duration_s},
          {"volume", utterance.volume},
          {"loop", utterance.loop},
          {"file", fs::path(utterance.file).filename().string()}};
}

Utterance fromJson(const Json& json, const fs::path& folder) {
  Utterance utterance;
  utterance.text = json.at("text").get<std::string>();
  utterance.voice = json.at("voice").get<std::string>();
  utterance.onset_ns = json.at("onset_ns").get<std::int64_t>();
  utterance.duration_s = json.at("duration_s").get<double>();
  utterance.volume = json.at("volume").get<double>();
  utterance.loop = json.at("loop").get<bool>();
  utterance.file = (folder / json.at("file").get<std::string>()).string();
  return utterance;
}

std::string fileName(std::size_t number) {
  std::string digits = std::to_string(number);
  digits.insert(0, digits.size() < 4 ? 4 - digits.size() : 0, '0');
  return "utterance_" + digits + ".wav";
}

}  // namespace

std::vector<Utterance> readSpeechLog(const std::string& path) {
  std::ifstream file = calib::openRegularFile(path);
  if (!file) throw std::runtime_error(path + ": cannot read");
  try {
    std::vector<Utterance> utterances;
    for (const Json& entry : Json::parse(file)) {
      utterances.push_back(fromJson(entry, fs::path(path).parent_path()));
    }
    return utterances;
  } catch (const Json::exception& error) {
    throw std::runtime_error(path + ": not a speech log: " + error.what());
  }
}

SpeechLog::SpeechLog(std::string folder) : folder_(std::move(folder)) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw std::runtime_error(folder_ + ": cannot make the folder: " + error.message());
  const fs::path log = fs::path(folder_) / kLogName;
  if (fs::exists(log)) {
    utterances_ = readSpeechLog(log.string());
  } else {
    save();
  }
}

std::size_t SpeechLog::add(Utterance utterance, const Sound& sound) {
  utterance.file = (fs::path(folder_) / fileName(utterances_.size() + 1)).string();
  writeWav(utterance.file, sound);
  utterances_.push_back(std::move(utterance));
  save();
  return utterances_.size() - 1;
}

void SpeechLog::setDuration(std::size_t index, double duration_s) {
  utterances_.at(index).duration_s = duration_s;
  save();
}

void SpeechLog::save() const {
  Json all = Json::array();
  for (const Utterance& utterance : utterances_) all.push_back(toJson(utterance));
  // A text that is no UTF-8 must not stop the log.
  calib::replaceFile((fs::path(folder_) / kLogName).string(),
                     all.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace afterglow::nodes
