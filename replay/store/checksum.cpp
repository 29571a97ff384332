#include "replay/store/checksum.hpp"

#include <openssl/sha.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

namespace afterglow::replay {

std::int64_t checksumOf(const std::uint8_t* bytes, std::size_t size) {
  return static_cast<std::int64_t>(XXH3_64bits(bytes, size));
}

std::string sha256(const Bytes& contents) {
  unsigned char digest[SHA256_DIGEST_LENGTH];
  SHA256(contents.data(), contents.size(), digest);
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : digest) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

}  // namespace afterglow::replay
