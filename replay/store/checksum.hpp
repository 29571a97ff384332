/// \file
/// The checksum of stored bytes. Internal to replay/store.
#pragma once

#include <cstddef>
#include <cstdint>

namespace afterglow::replay {

/// XXH3, 64 bits, seed 0, as SQLite's signed integer. Faster than the memory it reads.
std::int64_t checksumOf(const std::uint8_t* bytes, std::size_t size);

}  // namespace afterglow::replay
