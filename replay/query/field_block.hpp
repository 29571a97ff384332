/// \file
/// How the field index's blocks are laid out in bytes; shared by writer and reader. Internal to
/// replay/store.
///
/// ranges: how many messages (u16; 0: the block has no answers), then for each slot with values, in
/// ascending order: slot (u16), kinds (u8), size of its Bloom filter in bytes (u16); smallest and
/// largest number (f64 each) if there are numbers; first letters of the smallest and the largest
/// string (u8 length and bytes each) if there are strings. Little endian.
/// values: the Bloom filters, one after the other.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace afterglow::replay::field_block {

/// What kinds of values a slot has, and whether in every message.
enum Kind : std::uint8_t {
  kNumber = 1,  ///< a finite one; others are the texts that documents have for them
  kText = 4,
  kFalse = 8,
  kTrue = 16,
  kAlways = 32,
  kForeignText = 64,  ///< a string that is not ASCII: nothing is known of these
};

/// Letters of a string that its range knows, and those that its hash knows. std::string keeps 15
/// without an allocation.
constexpr std::size_t kRangeLetters = 15;
constexpr std::size_t kHashedLetters = 64;

constexpr std::size_t kBitsPerValue = 10;
constexpr int kHashes = 7;

/// Integers beyond are rounded in a double.
constexpr double kExactIntegers = 9007199254740992.0;

/// splitmix64's finalizer (Steele, Lea, Flood: Fast Splittable Pseudorandom Number Generators,
/// OOPSLA 2014).
inline std::uint64_t mixed(std::uint64_t bits) {
  bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9u;
  bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebu;
  return bits ^ (bits >> 31);
}

inline std::uint64_t hashOf(double number) {
  const double canonical = number == 0 ? 0.0 : number;  // no negative zero
  std::uint64_t bits;
  std::memcpy(&bits, &canonical, sizeof(bits));
  return mixed(bits + 0x9e3779b97f4a7c15u);
}

inline std::uint64_t hashOf(std::string_view text) {
  std::uint64_t hash = 0x51ed270b0a1f39c1u;
  text = text.substr(0, kHashedLetters);
  for (std::size_t at = 0; at < text.size(); at += 8) {
    std::uint64_t letters = 0;
    std::memcpy(&letters, text.data() + at, std::min<std::size_t>(8, text.size() - at));
    hash = mixed(hash ^ letters) + at;
  }
  return mixed(hash + text.size());
}

/// Calls visit(bit) for the bits of a value in a Bloom filter of so many bytes: all hashes from
/// one, as in A. Kirsch, M. Mitzenmacher: Less Hashing, Same Performance. ESA 2006.
template <typename Visit>
void forBits(std::uint64_t hash, std::size_t bytes, const Visit& visit) {
  const std::uint64_t bits = bytes * 8;
  const auto step = static_cast<std::uint32_t>(hash >> 32) | 1;
  auto at = static_cast<std::uint32_t>(hash);
  for (int i = 0; i < kHashes; ++i, at += step) visit(at * bits >> 32);
}

/// Of the letters that matter: a document has others in their place where they are no UTF-8.
inline bool isAscii(std::string_view text) {
  for (const char c : text.substr(0, kHashedLetters)) {
    if ((static_cast<unsigned char>(c) & 0x80) != 0) return false;
  }
  return true;
}

}  // namespace afterglow::replay::field_block
