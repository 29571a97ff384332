#include "replay/bags/bag_chunk.hpp"

#include <algorithm>
#include <string>

namespace afterglow::replay {

std::optional<BagFields> BagFields::parse(const std::uint8_t* bytes, std::size_t size) {
  BagFields parsed;
  parsed.fields_.reserve(4);
  const std::string_view all(reinterpret_cast<const char*>(bytes), size);
  for (std::size_t at = 0; at < size;) {
    if (size - at < 4) return std::nullopt;
    const std::size_t length = loadNumber<std::uint32_t>(bytes + at);
    at += 4;
    if (length > size - at) return std::nullopt;
    const std::string_view field = all.substr(at, length);
    const std::size_t equals = field.find('=');
    if (equals == std::string_view::npos) return std::nullopt;
    parsed.fields_.emplace_back(field.substr(0, equals), field.substr(equals + 1));
    at += length;
  }
  return parsed;
}

std::optional<std::string_view> BagFields::find(std::string_view name) const {
  for (const auto& [known, value] : fields_) {
    if (known == name) return value;
  }
  return std::nullopt;
}

BagChunk::BagChunk(Bytes bytes) : bytes_(std::move(bytes)) {
  std::size_t at = 0;
  const auto lengthAt = [&](const char* of) -> std::size_t {
    if (bytes_.size() - at < 4) throw BagDamage("ends within a length");
    const std::size_t length = loadNumber<std::uint32_t>(bytes_.data() + at);
    at += 4;
    if (length > bytes_.size() - at) {
      throw BagDamage(std::string("holds ") + of + " at its byte " + std::to_string(at) +
                      " that reaches beyond the chunk");
    }
    return length;
  };
  while (at < bytes_.size()) {
    Message message;
    message.offset = static_cast<std::uint32_t>(at);
    const std::size_t header_size = lengthAt("a record header");
    const auto fields = BagFields::parse(bytes_.data() + at, header_size);
    at += header_size;
    message.size = lengthAt("a record");
    message.begin = at;
    at += message.size;
    const auto kind = fields ? fields->number<std::uint8_t>("op") : std::nullopt;
    const auto connection = fields ? fields->number<std::uint32_t>("conn") : std::nullopt;
    const bool is_message = kind == static_cast<std::uint8_t>(BagRecord::MessageData);
    const bool is_connection = kind == static_cast<std::uint8_t>(BagRecord::Connection);
    if (!connection || (!is_message && !is_connection)) {
      throw BagDamage("holds a damaged record at its byte " + std::to_string(message.offset));
    }
    message.connection = *connection;
    message.time = fields->number<std::uint64_t>("time");
    if (is_message) {
      messages_.push_back(message);
    } else {
      const std::string topic(fields->find("topic").value_or(""));
      connections_.push_back({message.connection, topic, message.begin, message.size});
    }
  }
}

const BagChunk::Message* BagChunk::find(std::uint32_t offset) const {
  const auto found = std::lower_bound(
      messages_.begin(), messages_.end(), offset,
      [](const Message& message, std::uint32_t wanted) { return message.offset < wanted; });
  return found != messages_.end() && found->offset == offset ? &*found : nullptr;
}

}  // namespace afterglow::replay
