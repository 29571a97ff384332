#include "nodes/conversion/sound_request.hpp"

#include <string>

#include "replay/messages/document.hpp"
#include "replay/messages/schema.hpp"
#include "replay/messages/topic_name.hpp"

namespace afterglow::nodes {
namespace {

/// Leaves `value` unchanged if there is no such field.
template <typename T>
void take(const replay::Object& fields, const std::string& name, T& value) {
  for (const auto& [field_name, field] : fields) {
    if (field_name == name && std::holds_alternative<T>(field)) value = std::get<T>(field);
  }
}

}  // namespace

std::optional<sound_play::SoundRequest> soundRequestOf(const replay::Channel& channel,
                                                       const replay::Bytes& bytes) {
  sound_play::SoundRequest request;
  if (channel.type != replay::kSoundRequestType) return std::nullopt;
  try {
    const auto schema = replay::Schema::of(channel);
    const replay::Value document = replay::decode(schema, bytes);
    const auto& fields = std::get<replay::Object>(document);
    request.volume = 1;
    take(fields, "sound", request.sound);
    take(fields, "command", request.command);
    take(fields, "volume", request.volume);
    take(fields, "arg", request.arg);
    take(fields, "arg2", request.arg2);
  } catch (const replay::MessageError&) {
    return std::nullopt;
  }
  return request;
}

bool isSoundPlay(const std::string& node) {
  const auto has = [&](const char* name) { return node.find(name) != std::string::npos; };
  return has("soundplay") || has("sound_play");
}

std::string soundPlayVoice(const std::string& voice) {
  return voice.empty() || voice.rfind("voice_", 0) == 0 ? voice : "voice_kal_diphone";
}

}  // namespace afterglow::nodes
