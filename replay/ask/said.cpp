#include "replay/ask/said.hpp"

#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "replay/messages/document.hpp"
#include "replay/query/filter.hpp"

namespace afterglow::replay {
namespace {

constexpr const char* kSoundType = "sound_play/SoundRequest";
constexpr const char* kSpoken = R"({"sound": -3, "command": {"$ne": 0}})";  // sound_play's SAY
constexpr std::size_t kMostSentences = 20;

}  // namespace

std::vector<std::string> saidIn(const Store& store, const Behavior& behavior) {
  std::vector<std::string> sentences;
  MessageRange range;
  for (const TopicSummary& summary : store.topics(behavior)) {
    if (summary.type == kSoundType) range.topics.push_back(summary.topic);
  }
  if (range.topics.empty()) return sentences;
  range.where = std::make_shared<const Filter>(Filter::parse(kSpoken, Filter::Over::Messages));
  const auto cursor = store.messages(behavior, range);
  while (sentences.size() < kMostSentences) {
    const auto message = cursor->next();
    if (!message) break;
    try {
      const Channel channel = store.channel(message->channel);
      const Schema schema = Schema::parse(channel.type, channel.definition);
      const auto document = messageDocument(schema, *message);
      const auto said = document.find("arg");
      if (said != document.end() && said->is_string()) sentences.push_back(*said);
    } catch (const MessageError&) {  // of a definition that is none
    }
  }
  return sentences;
}

}  // namespace afterglow::replay
