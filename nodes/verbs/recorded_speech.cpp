#include "nodes/verbs/recorded_speech.hpp"

#include <afterglow/AskActionGoal.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "nodes/conversion/sound_request.hpp"
#include "replay/ask/said.hpp"
#include "replay/store/store_reading.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;
using sound_play::SoundRequest;

constexpr double kEndless_s = 1e9;
constexpr const char* kHumanVoice = "en-gb+f3";
constexpr double kPerByte_s = 0.065;  // about eSpeak NG's pace, for what cannot be heard

double secondsBetween(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(to_ns - from_ns) * 1e-9;
}

}  // namespace

RecordedSpeech::RecordedSpeech(const replay::Store& store, const replay::Behavior& behavior,
                               const std::string& folder)
    : folder_(folder), log_(folder) {
  listen(store, behavior);
  eachRecorded<AskActionGoal>(store, behavior, [&](replay::Stamp at, const AskActionGoal& asked) {
    questions_.push_back({asked.goal.question, kHumanVoice, at.ns, kEndless_s, 1, false, ""});
  });
  for (Utterance& utterance : utterances_) speak(utterance);
  for (Utterance& question : questions_) speak(question);
}

void RecordedSpeech::listen(const replay::Store& store, const replay::Behavior& behavior) {
  replay::MessageRange range;
  range.topics = replay::soundTopics(store, behavior);
  if (range.topics.empty()) return;
  replay::KnownChannels channels(store);
  const auto cursor = store.messages(behavior, range);
  while (const auto message = cursor->next()) {
    const auto request = soundRequestOf(channels.channel(message->channel), message->bytes);
    if (!request) continue;
    take(message->received, *request);
  }
}

void RecordedSpeech::take(replay::Stamp moment, const SoundRequest& request) {
  const bool is_sentence = request.sound == SoundRequest::SAY;
  if (request.command != SoundRequest::PLAY_STOP) {
    if (!is_sentence || request.arg.empty()) return;
    const double volume = static_cast<double>(request.volume);
    utterances_.push_back({request.arg, request.arg2, moment.ns, kEndless_s,
                           std::isfinite(volume) ? std::clamp(volume, 0.0, 1.0) : 1, false, ""});
    return;
  }
  for (Utterance& utterance : utterances_) {
    const bool is_meant =
        request.sound == SoundRequest::ALL || (is_sentence && utterance.text == request.arg);
    if (!is_meant) continue;
    utterance.duration_s =
        std::min(utterance.duration_s, secondsBetween(utterance.onset_ns, moment.ns));
  }
}

void RecordedSpeech::speak(Utterance& utterance) {
  try {
    if (!speech_) speech_.emplace(SpeechOptions{"en-us", 160, "auto"});
    const auto sound = speech_->say(utterance.text, utterance.voice);
    utterance.duration_s = std::min(utterance.duration_s, sound->seconds());
    log_.add(utterance, *sound);
  } catch (const std::exception& error) {
    const double about_s = 0.5 + kPerByte_s * static_cast<double>(utterance.text.size());
    utterance.duration_s = std::min(utterance.duration_s, about_s);
    if (!problem_.empty()) return;
    problem_ = std::string("what was said is shown, not heard: ") + error.what();
  }
}

std::string RecordedSpeech::saidAt(replay::Stamp moment) const {
  const auto sounds = [&](const Utterance& utterance) {
    const double since_s = secondsBetween(utterance.onset_ns, moment.ns);
    return since_s >= 0 && since_s < utterance.duration_s;
  };
  const auto latest = std::find_if(utterances_.rbegin(), utterances_.rend(), sounds);
  return latest == utterances_.rend() ? "" : latest->text;
}

std::string RecordedSpeech::askedAt(replay::Stamp moment) const {
  const auto latest = std::find_if(questions_.rbegin(), questions_.rend(),
                                   [&](const auto& asked) { return asked.onset_ns <= moment.ns; });
  return latest == questions_.rend() ? "" : latest->text;
}

std::vector<Utterance> RecordedSpeech::heard() const {
  return readSpeechLog((fs::path(folder_) / "speech.json").string());
}

}  // namespace afterglow::nodes
