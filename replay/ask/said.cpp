#include "replay/ask/said.hpp"

#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "replay/messages/document.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/query/filter.hpp"
#include "replay/store/store_reading.hpp"

namespace afterglow::replay {
namespace {

/// Sentences and files (sound -3 and -2), but not the order to stop one (command 0).
constexpr const char* kHeard = R"({"sound": {"$in": [-3, -2]}, "command": {"$ne": 0}})";
constexpr std::size_t kMostSentences = 20;

std::optional<Utterance> utteranceOf(KnownChannels& channels, const Message& message) {
  try {
    const auto document = messageDocument(channels.schema(message.channel), message);
    const auto text = document.find("arg");
    if (text == document.end() || !text->is_string()) return std::nullopt;
    return Utterance{message.received, *text, document.value("sound", 0) == -3, message.sequence};
  } catch (const MessageError&) {
    return std::nullopt;
  }
}

}  // namespace

std::vector<std::string> soundTopics(const Store& store, const Behavior& behavior) {
  std::set<std::string> topics;
  for (const auto& known : {store.topics(behavior), store.contextTopics(behavior)}) {
    for (const TopicSummary& summary : known) {
      if (summary.type == kSoundRequestType) topics.insert(summary.topic);
    }
  }
  return {topics.begin(), topics.end()};
}

void hearUtterances(const Store& store, const Behavior& behavior, MessageRange range,
                    const std::function<bool(const Utterance&)>& on_said) {
  range.topics = soundTopics(store, behavior);
  if (range.topics.empty()) return;
  range.where = std::make_shared<const Filter>(Filter::parse(kHeard, Filter::Over::Messages));
  KnownChannels channels(store);
  const auto cursor = store.messages(behavior, range);
  while (const auto message = cursor->next()) {
    const auto said = utteranceOf(channels, *message);
    if (said && !on_said(*said)) return;
  }
}

std::vector<Utterance> sentencesIn(const Store& store, const Behavior& behavior,
                                   std::size_t most) {
  std::vector<Utterance> sentences;
  hearUtterances(store, behavior, {}, [&](const Utterance& said) {
    if (said.is_sentence) sentences.push_back(said);
    return sentences.size() < most;
  });
  return sentences;
}

std::vector<std::string> saidIn(const Store& store, const Behavior& behavior) {
  std::vector<std::string> texts;
  for (const Utterance& said : sentencesIn(store, behavior, kMostSentences)) {
    texts.push_back(said.text);
  }
  return texts;
}

}  // namespace afterglow::replay
