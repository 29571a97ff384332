/// \file
/// The records of MCAP files. Source of the format: mcap.dev/spec. Own code, as no Debian release
/// packages the MCAP library, and the store's ways in and out trust no length in a file. Internal
/// to replay.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "replay/bags/packing.hpp"
#include "replay/messages/wire.hpp"

namespace afterglow::replay {

/// The first and the last bytes of a file.
constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8);
/// Kind and length, before the content.
constexpr std::size_t kMcapRecordHeader = 9;

enum class McapRecord : std::uint8_t {
  Header = 0x01,
  Footer = 0x02,
  Schema = 0x03,
  Channel = 0x04,
  Message = 0x05,
  Chunk = 0x06,
  MessageIndex = 0x07,
  ChunkIndex = 0x08,
  Attachment = 0x09,
  AttachmentIndex = 0x0A,
  Statistics = 0x0B,
  Metadata = 0x0C,
  MetadataIndex = 0x0D,
  SummaryOffset = 0x0E,
  DataEnd = 0x0F,
};

/// A definition of messages.
struct McapSchema {
  std::string name, encoding, text;

  friend bool operator==(const McapSchema& a, const McapSchema& b) {
    return a.name == b.name && a.encoding == b.encoding && a.text == b.text;
  }
};

struct McapChannel {
  std::uint16_t schema = 0;  ///< 0: none
  std::string topic, encoding;
  std::map<std::string, std::string> metadata;

  friend bool operator==(const McapChannel& a, const McapChannel& b) {
    return a.schema == b.schema && a.topic == b.topic && a.encoding == b.encoding &&
           a.metadata == b.metadata;
  }
};

/// Walks a record's content from its first byte on; throws BagDamage instead of leaving it.
class McapFields {
 public:
  McapFields(const std::uint8_t* bytes, std::size_t size) : at_(bytes), end_(bytes + size) {}

  std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }
  const std::uint8_t* take(std::uint64_t size) {
    if (size > left()) throw BagDamage("has a field that reaches beyond its end");
    const std::uint8_t* begin = at_;
    at_ += size;
    return begin;
  }
  template <typename T>
  T number() {
    return loadNumber<T>(take(sizeof(T)));
  }
  std::string string() {
    const auto size = number<std::uint32_t>();
    const std::uint8_t* begin = take(size);
    return {begin, begin + size};
  }
  std::map<std::string, std::string> strings() {
    const auto size = number<std::uint32_t>();
    McapFields inside(take(size), size);
    std::map<std::string, std::string> map;
    while (inside.left() > 0) {
      std::string key = inside.string();
      map[std::move(key)] = inside.string();
    }
    return map;
  }

 private:
  const std::uint8_t* at_;
  const std::uint8_t* end_;
};

}  // namespace afterglow::replay
