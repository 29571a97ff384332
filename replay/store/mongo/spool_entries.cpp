#include "replay/store/mongo/spool_entries.hpp"

#include <cstring>

#include "replay/store/mongo/mongo_layout.hpp"

namespace afterglow::replay {
namespace {

template <typename T>
void put(Bytes& bytes, T value) {
  const auto* data = reinterpret_cast<const std::uint8_t*>(&value);
  bytes.insert(bytes.end(), data, data + sizeof value);
}

/// Reads what put() wrote; the database's pages are trusted, but not beyond their end.
class EntryReader {
 public:
  explicit EntryReader(const Bytes& bytes) : bytes_(bytes) {}
  bool atEnd() const { return at_ == bytes_.size(); }
  template <typename T>
  T get() {
    T value;
    std::memcpy(&value, take(sizeof value), sizeof value);
    return value;
  }
  const std::uint8_t* take(std::size_t size) {
    if (bytes_.size() - at_ < size) throw StoreError("the spool is damaged: an entry is cut off");
    at_ += size;
    return bytes_.data() + at_ - size;
  }

 private:
  const Bytes& bytes_;
  std::size_t at_ = 0;
};

}  // namespace

Bytes packBehavior(const Behavior& behavior) {
  const Bson state = toMongo(behavior);
  const std::uint8_t* data = bson_get_data(&state.raw());
  return Bytes(data, data + state.size());
}

Bytes packId(std::int64_t id) {
  Bytes payload;
  put(payload, id);
  return payload;
}

Bytes packFile(const std::string& sha256, const Bytes& contents) {
  Bytes payload;
  put(payload, static_cast<std::uint64_t>(sha256.size()));
  payload.insert(payload.end(), sha256.begin(), sha256.end());
  payload.insert(payload.end(), contents.begin(), contents.end());
  return payload;
}

std::int64_t unpackId(const Bytes& payload) { return EntryReader(payload).get<std::int64_t>(); }

Bytes packMessages(const std::vector<Message>& messages, std::size_t begin, std::size_t end) {
  constexpr std::size_t kHead = 5 * 8 + 1;
  std::size_t size = 0;
  for (std::size_t i = begin; i < end; ++i) size += kHead + messages[i].bytes.size();
  Bytes payload;
  payload.reserve(size);
  for (std::size_t i = begin; i < end; ++i) {
    const Message& message = messages[i];
    put(payload, message.channel);
    put(payload, message.received.ns);
    put(payload, message.sequence);
    put(payload, std::uint8_t{message.header_stamp.has_value()});
    put(payload, message.header_stamp.value_or(Stamp{}).ns);
    put(payload, static_cast<std::uint64_t>(message.bytes.size()));
    payload.insert(payload.end(), message.bytes.begin(), message.bytes.end());
  }
  return payload;
}

std::vector<Message> unpackMessages(const Bytes& payload) {
  std::vector<Message> messages;
  for (EntryReader reader(payload); !reader.atEnd();) {
    Message message;
    message.channel = reader.get<std::int64_t>();
    message.received = {reader.get<std::int64_t>()};
    message.sequence = reader.get<std::uint64_t>();
    const bool has_header = reader.get<std::uint8_t>() != 0;
    const Stamp header{reader.get<std::int64_t>()};
    if (has_header) message.header_stamp = header;
    const auto size = reader.get<std::uint64_t>();
    const std::uint8_t* data = reader.take(size);
    message.bytes.assign(data, data + size);
    messages.push_back(std::move(message));
  }
  return messages;
}

Behavior unpackBehavior(const Bytes& payload) {
  bson_t state;
  if (!bson_init_static(&state, payload.data(), payload.size())) {
    throw StoreError("the spool is damaged: a behavior is no BSON");
  }
  return behaviorFromMongo(state);
}

std::pair<std::string, Bytes> unpackFile(const Bytes& payload) {
  EntryReader reader(payload);
  const auto size = reader.get<std::uint64_t>();
  const auto* name = reinterpret_cast<const char*>(reader.take(size));
  return {std::string(name, size),
          Bytes(payload.begin() + static_cast<std::ptrdiff_t>(8 + size), payload.end())};
}

}  // namespace afterglow::replay
