/// \file
/// The records in a bag's chunk, read without trusting any length in it. Source of the format:
/// wiki.ros.org/Bags/Format/2.0. Internal to replay.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "replay/bags/packing.hpp"
#include "replay/messages/message.hpp"
#include "replay/messages/wire.hpp"

namespace afterglow::replay {

enum class BagRecord : std::uint8_t {
  MessageData = 0x02,
  BagHeader = 0x03,
  IndexData = 0x04,
  Chunk = 0x05,
  ChunkInfo = 0x06,
  Connection = 0x07,
};

/// The fields of a record's header. Views into bytes that must outlive it.
class BagFields {
 public:
  /// Empty if the bytes are no fields.
  static std::optional<BagFields> parse(const std::uint8_t* bytes, std::size_t size);

  /// Empty if there is no such field.
  std::optional<std::string_view> find(std::string_view name) const;
  /// Empty if there is no such field of this size.
  template <typename T>
  std::optional<T> number(std::string_view name) const {
    const auto value = find(name);
    if (!value || value->size() != sizeof(T)) return std::nullopt;
    return loadNumber<T>(reinterpret_cast<const std::uint8_t*>(value->data()));
  }

 private:
  std::vector<std::pair<std::string_view, std::string_view>> fields_;
};

/// An unpacked chunk: records that follow each other to its last byte.
class BagChunk {
 public:
  struct Message {
    std::uint32_t offset = 0;  ///< offset of the record, as the index names it
    std::uint32_t connection = 0;
    /// Time of reception: seconds, and nanoseconds above them; as its own header says.
    std::optional<std::uint64_t> time;
    std::size_t begin = 0, size = 0;  ///< range of the data
    /// The time of reception by the record's own field.
    Stamp received() const {
      return Stamp::fromParts(static_cast<std::uint32_t>(*time),
                              static_cast<std::uint32_t>(*time >> 32));
    }
  };
  struct Connection {
    std::uint32_t connection = 0;
    std::string topic;
    std::size_t begin = 0, size = 0;  ///< range of the data, which are fields
  };

  /// Throws BagDamage.
  explicit BagChunk(Bytes bytes);

  /// Null if no message begins there.
  const Message* find(std::uint32_t offset) const;
  /// The data of a message or a connection.
  template <typename Part>
  Bytes data(const Part& part) const {
    const auto begin = bytes_.begin() + static_cast<std::ptrdiff_t>(part.begin);
    return Bytes(begin, begin + static_cast<std::ptrdiff_t>(part.size));
  }
  const std::vector<Message>& messages() const { return messages_; }  ///< the messages, by offset
  const std::vector<Connection>& connections() const { return connections_; }
  std::size_t size() const { return bytes_.size(); }

 private:
  Bytes bytes_;
  std::vector<Message> messages_;
  std::vector<Connection> connections_;
};

}  // namespace afterglow::replay
