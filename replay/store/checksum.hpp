/// \file
/// Checksums of stored bytes.
#pragma once

#include <string>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// Returns the checksum of a message or a piece of it: XXH3, 64 bits, seed 0, as SQLite's signed
/// integer. Faster than the memory it reads.
std::int64_t checksumOf(const std::uint8_t* bytes, std::size_t size);

/// Returns the name by which the store keeps a file: SHA-256, 64 hex digits.
std::string sha256(const Bytes& contents);

}  // namespace afterglow::replay
