#include "nodes/ros2/ros2_types.hpp"

#include "replay/messages/definitions.hpp"
#include "replay/messages/schema.hpp"
#include "replay/messages/text.hpp"
#include "replay/ros2/ros2_definition.hpp"
#include "replay/ros2/type_description.hpp"

namespace afterglow::nodes {
namespace {

/// A node that is not asleep answers within milliseconds.
constexpr auto kPatience = std::chrono::seconds(2);
constexpr const char* kService = "/get_type_description";

/// The GUID of the participant of a reader or writer.
DdsGuid participantOf(DdsGuid guid) {
  for (std::size_t i = 12; i < guid.bytes.size(); ++i) guid.bytes[i] = 0;
  return guid;
}

std::string installedDefinition(const std::string& type) {
  return replay::installedRos2Definitions().fullText(replay::ros1TypeName(type)).value_or("");
}

}  // namespace

Ros2Types::Ros2Types(DdsParticipant& participant, std::function<void()> on_answer)
    : participant_(participant), on_answer_(std::move(on_answer)) {}

std::optional<std::string> Ros2Types::told(const std::string& type, const std::string& hash) {
  const std::lock_guard<std::mutex> lock(answers_mutex_);
  const auto found = told_.find({type, hash});
  if (found == told_.end()) return std::nullopt;
  return found->second;
}

std::optional<std::string> Ros2Types::find(const std::string& type, const DdsEndpoint& endpoint,
                                           const std::vector<DdsEndpoint>& all) {
  const Key key(type, participantOf(endpoint.guid));
  if (const auto definition = told(type, endpoint.type_hash)) {
    questions_.erase(key);
    return definition;
  }
  const bool may_tell = !endpoint.type_hash.empty() && silent_.count(key) == 0;
  if (!may_tell) return installedDefinition(type);
  const auto now = std::chrono::steady_clock::now();
  const auto [entry, is_new] = questions_.try_emplace(key);
  if (is_new) entry->second.end = now + kPatience;
  if (now < entry->second.end) {
    ask(key, entry->second, endpoint.type_hash, all);
    return std::nullopt;
  }
  silent_.insert(key);
  questions_.erase(entry);
  return installedDefinition(type);
}

void Ros2Types::ask(const Key& key, Question& question, const std::string& hash,
                    const std::vector<DdsEndpoint>& all) {
  bool is_refused = false;
  {
    const std::lock_guard<std::mutex> lock(answers_mutex_);
    is_refused = refused_.erase(key) > 0;
  }
  if (is_refused) question.client.reset();
  for (const DdsEndpoint& other : all) {
    if (question.client) break;
    const auto service = replay::serviceOfDds(other.topic);
    if (other.is_writer || !service || !replay::endsWith(*service, kService) ||
        !other.guid.isOfParticipant(key.second) || !question.asked.insert(*service).second) {
      continue;
    }
    question.is_sent = false;
    question.client = std::make_unique<DdsServiceClient>(
        participant_, replay::serviceNames(*service, replay::kTypeDescriptionService),
        [this, key, hash](std::int64_t, replay::Bytes&& reply) { take(key, hash, reply); });
  }
  if (!question.client || question.is_sent || !question.client->isServed()) return;
  question.client->send(replay::typeDescriptionRequest(key.first, hash));
  question.is_sent = true;
}

void Ros2Types::take(const Key& key, const std::string& hash, const replay::Bytes& reply) {
  {
    const std::lock_guard<std::mutex> lock(answers_mutex_);
    try {
      std::string definition = replay::definitionIn(reply);
      told_[{key.first, hash}] = std::move(definition);
    } catch (const replay::MessageError&) {  // another node of the participant may know it
      refused_.insert(key);
    }
  }
  on_answer_();
}

}  // namespace afterglow::nodes
