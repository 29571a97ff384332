#include "nodes/speaker/speech.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <vector>

namespace afterglow::nodes {
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
