#include "nodes/speaker/speech.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "nodes/tools/program.hpp"

namespace afterglow::nodes {
namespace {

bool isEnglish(const std::string& voice) { return voice.rfind("en", 0) == 0; }

/// A file for a WAV, gone with the object. pico2wave demands the ending.
class WavFile {
 public:
  WavFile() {
    const int file = ::mkstemps(path_.data(), 4);
    if (file < 0) throw std::runtime_error("cannot make " + path_ + " for speech");
    ::close(file);
  }
  WavFile(const WavFile&) = delete;
  WavFile& operator=(const WavFile&) = delete;
  ~WavFile() { ::unlink(path_.c_str()); }
  const std::string& path() const { return path_; }

 private:
  std::error_code no_folder_;  ///< then making the file fails, and says where
  std::string path_ =
      (std::filesystem::temp_directory_path(no_folder_) / "afterglow_speech_XXXXXX.wav").string();
};

/// Speaks by a program that takes the WAV file to write, and what to say, as these two take them.
Sound sayBy(std::vector<std::string> command, const std::string& text) {
  const WavFile file;
  for (const std::string& word : {std::string("-w"), file.path(), std::string("--"), text}) {
    command.push_back(word);
  }
  const ProgramResult result = runProgram(command);
  if (result.status != 0) {
    throw std::runtime_error(command.front() + " ended with status " +
                             std::to_string(result.status) + " on \"" + text + "\"");
  }
  return readWav(file.path());
}

}  // namespace

std::string mbrolaVoice() {
  if (!hasProgram("mbrola")) return "";
  for (const std::string name : {"us1", "en1", "us2", "us3"}) {
    if (std::filesystem::exists("/usr/share/mbrola/" + name + "/" + name)) return "mb-" + name;
  }
  return "";
}

SpeechEngine chooseEngine(const std::string& wanted, const std::string& voice) {
  if (wanted == "espeak") return SpeechEngine::Espeak;
  const bool is_auto = wanted.empty() || wanted == "auto";
  if (is_auto && !isEnglish(voice)) return SpeechEngine::Espeak;
  if ((is_auto || wanted == "pico") && hasProgram("pico2wave")) return SpeechEngine::Pico;
  if ((is_auto || wanted == "mbrola") && !mbrolaVoice().empty()) return SpeechEngine::Mbrola;
  if (is_auto) return SpeechEngine::Espeak;
  const bool is_known = wanted == "pico" || wanted == "mbrola";
  throw std::runtime_error(
      "~engine is \"" + wanted + "\", " +
      (is_known ? "which is not installed" : "and has to be auto, pico, mbrola or espeak"));
}

bool hasEspeakVoice(const std::string& voice) {
  if (!hasProgram("espeak-ng")) {
    throw std::runtime_error("espeak-ng is not installed (package espeak-ng): nothing can be said");
  }
  return runProgram({"espeak-ng", "-q", "-v", voice, "--", ""}).status == 0;
}

Sound sayByEspeak(const std::string& text, const std::string& voice, int words_per_minute) {
  const std::string utf8 = "1";
  return sayBy({"espeak-ng", "-b", utf8, "-v", voice, "-s", std::to_string(words_per_minute)},
               text);
}

Sound sayByPico(const std::string& text, const std::string& voice) {
  return sayBy({"pico2wave", "-l", voice.rfind("en-gb", 0) == 0 ? "en-GB" : "en-US"}, text);
}

namespace {

constexpr std::size_t kLongestText = 4000;   // bytes; about five minutes
constexpr std::size_t kMostRemembered = 64;  // sentences
constexpr double kEdge_s = 0.005;            // kept before and after what can be heard
constexpr int kAudible = 160;                // of 32767: 46 dB below full scale

/// Cuts silence at both ends: onset and duration are then those of what is heard.
void trim(Sound& sound) {
  const auto audible = [](std::int16_t sample) { return std::abs(int{sample}) > kAudible; };
  auto& samples = sound.samples;
  const auto edge = static_cast<std::ptrdiff_t>(std::lround(kEdge_s * sound.sample_rate));
  auto first = std::find_if(samples.begin(), samples.end(), audible);
  auto last = std::find_if(samples.rbegin(), samples.rend(), audible).base();
  if (first == samples.end()) return samples.clear();
  first -= std::min(edge, first - samples.begin());
  last += std::min(edge, samples.end() - last);
  samples = std::vector<std::int16_t>(first, last);
}

bool isVoiceName(const std::string& name) {
  // eSpeak NG opens other names as files.
  return std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '+';
  });
}

/// A voice and what stands in for it where it is not installed, by language and speaker:
/// "en-gb+f3", "en+f3", "en-gb", "en". eSpeak NG's data name them otherwise from version to version.
std::vector<std::string> voicesLike(const std::string& name) {
  const std::size_t plus = std::min(name.find('+'), name.size());
  const std::string language = name.substr(0, plus), speaker = name.substr(plus);
  const std::string whole = language.substr(0, language.find('-'));
  return {name, whole + speaker, language, whole};
}

}  // namespace

Speech::Speech(const SpeechOptions& options)
    : options_(options), engine_(chooseEngine(options.engine, options.voice)) {
  if (engine_ == SpeechEngine::Mbrola) options_.voice = mbrolaVoice();
  knownVoice(options_.voice);
}

std::string Speech::defaultVoice() const {
  if (engine_ == SpeechEngine::Pico) return "pico2wave";
  return "eSpeak NG, voice " + options_.voice;
}

std::string Speech::knownVoice(const std::string& requested) {
  const bool festival = requested.rfind("voice_", 0) == 0;
  const std::string& voice = requested.empty() || festival ? options_.voice : requested;
  if (const auto known = voices_.find(voice); known != voices_.end()) return known->second;
  for (const std::string& like : voicesLike(voice)) {
    if (isVoiceName(like) && hasEspeakVoice(like)) return voices_[voice] = like;
  }
  throw std::runtime_error("no voice \"" + voice +
                           "\" (espeak-ng --voices lists those there are)");
}

std::shared_ptr<const Sound> Speech::say(const std::string& text, const std::string& requested) {
  if (text.size() > kLongestText) {
    throw std::runtime_error("a text of " + std::to_string(text.size()) + " bytes; at most " +
                             std::to_string(kLongestText) + " are said at once");
  }
  const std::string voice = knownVoice(requested);
  const auto found = said_.find({text, voice});
  if (found != said_.end()) return found->second;
  auto sound = std::make_shared<const Sound>(synthesize(text, voice));
  if (sound->samples.empty()) throw std::runtime_error("nothing to say in \"" + text + "\"");
  if (said_.size() >= kMostRemembered) said_.clear();
  said_.emplace(std::make_pair(text, voice), sound);
  return sound;
}

Sound Speech::synthesize(const std::string& text, const std::string& voice) {
  const bool is_pico = engine_ == SpeechEngine::Pico && voice == options_.voice;
  Sound sound =
      is_pico ? sayByPico(text, voice) : sayByEspeak(text, voice, options_.words_per_minute);
  trim(sound);
  return sound;
}

}  // namespace afterglow::nodes
