/// \file
/// Compression of the chunks of recordings. Internal to replay.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// Bytes that violate the format; the text completes "the chunk at byte 4117 ...".
class BagDamage : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Lz4 is the frame format. Zstd needs libzstd; built without it, it throws BagDamage saying so.
enum class Packing { None, Bz2, Lz4, Zstd };

/// The `size` bytes that were packed. Memory grows with the unpacked bytes, not with `size`. Throws
/// BagDamage if their number is another one.
Bytes unpack(Packing packing, Bytes packed, std::size_t size);

/// The size that a zstd frame says to have unpacked; empty: the bytes are none, or it does not say.
std::optional<std::uint64_t> zstdSize(const Bytes& packed);

/// Packs the bytes. Throws BagDamage.
Bytes pack(Packing packing, const Bytes& bytes);

inline void append(Bytes& to, const Bytes& bytes) {
  to.insert(to.end(), bytes.begin(), bytes.end());
}

}  // namespace afterglow::replay
