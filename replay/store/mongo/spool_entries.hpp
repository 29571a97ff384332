/// \file
/// The bytes of the entries that wait in a Spool. Internal to replay/store.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::replay {

// unpack...() throws StoreError for bytes that are cut off.

/// The messages [begin, end).
Bytes packMessages(const std::vector<Message>& messages, std::size_t begin, std::size_t end);
std::vector<Message> unpackMessages(const Bytes& payload);

Bytes packBehavior(const Behavior& behavior);
Behavior unpackBehavior(const Bytes& payload);

/// The id of a behavior that is removed.
Bytes packId(std::int64_t id);
std::int64_t unpackId(const Bytes& payload);

/// SHA-256 and contents.
Bytes packFile(const std::string& sha256, const Bytes& contents);
std::pair<std::string, Bytes> unpackFile(const Bytes& payload);

}  // namespace afterglow::replay
