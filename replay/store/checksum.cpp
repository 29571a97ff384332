#include "replay/store/checksum.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace afterglow::replay {

std::int64_t checksumOf(const std::uint8_t* bytes, std::size_t size) {
  return static_cast<std::int64_t>(XXH3_64bits(bytes, size));
}

}  // namespace afterglow::replay
