#include "replay/ask/said.hpp"

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "replay/messages/document.hpp"
#include "replay/query/filter.hpp"

namespace afterglow::replay {
namespace {

constexpr const char* kSoundType = "sound_play/SoundRequest";
/// Sentences and files (sound -3 and -2), but not the order to stop one (command 0).
constexpr const char* kHeard = R"({"sound": {"$in": [-3, -2]}, "command": {"$ne": 0}})";
constexpr std::size_t kMostSentences = 20;

/// The schemas of a store's channels; none of a definition that is none.
class Schemas {
 public:
  explicit Schemas(const Store& store) : store_(store) {}
  const std::optional<Schema>& of(std::int64_t id) {
    const auto [known, is_new] = known_.try_emplace(id);
    if (is_new) {
      const Channel channel = store_.channel(id);
      try {
        known->second = Schema::parse(channel.type, channel.definition);
      } catch (const MessageError&) {  // its messages are left out
      }
    }
    return known->second;
  }

 private:
  const Store& store_;
  std::map<std::int64_t, std::optional<Schema>> known_;
};

std::optional<Utterance> utteranceOf(const Schema& schema, const Message& message) {
  try {
    const auto document = messageDocument(schema, message);
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
      if (summary.type == kSoundType) topics.insert(summary.topic);
    }
  }
  return {topics.begin(), topics.end()};
}

void hearUtterances(const Store& store, const Behavior& behavior, MessageRange range,
                    const std::function<bool(const Utterance&)>& on_said) {
  range.topics = soundTopics(store, behavior);
  if (range.topics.empty()) return;
  range.where = std::make_shared<const Filter>(Filter::parse(kHeard, Filter::Over::Messages));
  Schemas schemas(store);
  const auto cursor = store.messages(behavior, range);
  while (const auto message = cursor->next()) {
    const auto& schema = schemas.of(message->channel);
    const auto said = schema ? utteranceOf(*schema, *message) : std::nullopt;
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
