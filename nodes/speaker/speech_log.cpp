#include "nodes/speaker/speech_log.hpp"

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "calib/file_replacement.hpp"

namespace afterglow::nodes {
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
