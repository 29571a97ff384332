/// \file
/// BSON documents in C++ terms: built from a chain of add(), read by dotted paths. Needs libbson;
/// for .cpp files and internal headers of replay/store.
#pragma once

#include <bson/bson.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// A document that owns its bytes. Building one beyond BSON's 2 GiB throws StoreError.
class Bson {
 public:
  Bson() { bson_init(&bson_); }
  explicit Bson(const bson_t& other) { bson_copy_to(&other, &bson_); }
  Bson(Bson&& other) noexcept {
    bson_steal(&bson_, &other.bson_);
    bson_init(&other.bson_);
  }
  Bson(const Bson& other) : Bson(other.bson_) {}
  Bson& operator=(const Bson&) = delete;
  ~Bson() { bson_destroy(&bson_); }

  Bson& add(std::string_view key, std::int64_t value);
  Bson& add(std::string_view key, int value) { return add(key, std::int64_t{value}); }
  Bson& add(std::string_view key, double value);
  Bson& add(std::string_view key, bool value);
  /// A text that is no UTF-8 becomes Binary.
  Bson& add(std::string_view key, std::string_view text);
  Bson& add(std::string_view key, const std::string& text) {
    return add(key, std::string_view(text));
  }
  Bson& add(std::string_view key, const char* text) { return add(key, std::string_view(text)); }
  Bson& add(std::string_view key, const Bytes& bytes) {
    return addBinary(key, bytes.data(), bytes.size());
  }
  Bson& add(std::string_view key, const Bson& document);
  Bson& add(std::string_view key, const std::vector<Bson>& documents);
  Bson& add(std::string_view key, const std::vector<std::string>& texts);
  Bson& add(std::string_view key, const std::vector<std::int64_t>& numbers);
  Bson& addBinary(std::string_view key, const std::uint8_t* data, std::size_t size);
  Bson& addDate(std::string_view key, std::int64_t ms_since_epoch);
  Bson& addNull(std::string_view key);

  bool empty() const { return bson_empty(&bson_); }
  std::size_t size() const { return bson_.len; }
  bson_t& raw() { return bson_; }
  const bson_t& raw() const { return bson_; }
  std::string json() const;  ///< text for people

 private:
  template <typename T>
  Bson& addArray(std::string_view key, const std::vector<T>& values);

  bson_t bson_;
};

/// {_id: id}
inline Bson withId(std::int64_t id) { return std::move(Bson().add("_id", id)); }
inline Bson withId(const std::string& id) { return std::move(Bson().add("_id", id)); }

/// The wall clock as a BSON date: milliseconds since the epoch.
std::int64_t wallClock_ms();

/// The value at `path` ("_meta.sequence"); empty where it is missing or of another kind.
std::optional<std::int64_t> integerAt(const bson_t& document, const char* path);
/// Milliseconds since the epoch.
std::optional<std::int64_t> dateAt(const bson_t& document, const char* path);
bool isTrueAt(const bson_t& document, const char* path);  ///< true, or a number that is not 0
bool hasAt(const bson_t& document, const char* path);     ///< true for a value of any kind
std::optional<std::string> textAt(const bson_t& document, const char* path);  ///< text or Binary
std::optional<Bytes> bytesAt(const bson_t& document, const char* path);
std::vector<std::string> textsAt(const bson_t& document, const char* path);

/// A copy in which numbers that are not finite are the strings "nan", "inf", "-inf"; empty if there
/// are none. For servers that do not take them.
std::optional<Bson> withoutNonFinite(const bson_t& document);

}  // namespace afterglow::replay
