#include "replay/store/sha256.hpp"

#include <openssl/sha.h>

namespace afterglow::replay {

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
