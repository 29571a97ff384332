#include "replay/store/mongo/mongo_bson.hpp"

#include <utf8.h>

#include <chrono>
#include <cmath>

#include "replay/store/store.hpp"

namespace afterglow::replay {
namespace {

void require(bool appended) {
  if (!appended) throw StoreError("a document beyond 2 GiB");
}

int length(std::string_view text) { return static_cast<int>(text.size()); }

bool find(const bson_t& document, const char* path, bson_iter_t& found) {
  bson_iter_t iter;
  return bson_iter_init(&iter, &document) && bson_iter_find_descendant(&iter, path, &found);
}

std::optional<std::string> text(const bson_iter_t& at) {
  std::uint32_t size = 0;
  if (BSON_ITER_HOLDS_UTF8(&at)) {
    const char* data = bson_iter_utf8(&at, &size);
    return std::string(data, size);
  }
  if (!BSON_ITER_HOLDS_BINARY(&at)) return std::nullopt;
  const std::uint8_t* data = nullptr;
  bson_iter_binary(&at, nullptr, &size, &data);
  return std::string(reinterpret_cast<const char*>(data), size);
}

bool isNonFinite(const bson_iter_t& at) {
  return BSON_ITER_HOLDS_DOUBLE(&at) && !std::isfinite(bson_iter_double(&at));
}

bool hasNonFinite(const bson_iter_t& begin) {
  bson_iter_t at = begin;
  while (bson_iter_next(&at)) {
    if (isNonFinite(at)) return true;
    bson_iter_t child;
    const bool is_nested = BSON_ITER_HOLDS_DOCUMENT(&at) || BSON_ITER_HOLDS_ARRAY(&at);
    if (is_nested && bson_iter_recurse(&at, &child) && hasNonFinite(child)) return true;
  }
  return false;
}

void copyFinite(const bson_iter_t& begin, bson_t& to) {
  bson_iter_t from = begin;
  while (bson_iter_next(&from)) {
    const char* key = bson_iter_key(&from);
    bson_iter_t child;
    bson_t inner;
    if (isNonFinite(from)) {
      const double value = bson_iter_double(&from);
      const char* word = std::isnan(value) ? "nan" : value < 0 ? "-inf" : "inf";
      require(bson_append_utf8(&to, key, -1, word, -1));
    } else if (BSON_ITER_HOLDS_DOCUMENT(&from) && bson_iter_recurse(&from, &child)) {
      require(bson_append_document_begin(&to, key, -1, &inner));
      copyFinite(child, inner);
      require(bson_append_document_end(&to, &inner));
    } else if (BSON_ITER_HOLDS_ARRAY(&from) && bson_iter_recurse(&from, &child)) {
      require(bson_append_array_begin(&to, key, -1, &inner));
      copyFinite(child, inner);
      require(bson_append_array_end(&to, &inner));
    } else {
      require(bson_append_iter(&to, key, -1, &from));
    }
  }
}

}  // namespace

Bson& Bson::add(std::string_view key, std::int64_t value) {
  require(bson_append_int64(&bson_, key.data(), length(key), value));
  return *this;
}

Bson& Bson::add(std::string_view key, double value) {
  require(bson_append_double(&bson_, key.data(), length(key), value));
  return *this;
}

Bson& Bson::add(std::string_view key, bool value) {
  require(bson_append_bool(&bson_, key.data(), length(key), value));
  return *this;
}

Bson& Bson::add(std::string_view key, std::string_view text) {
  if (!utf8::is_valid(text.begin(), text.end())) {
    return addBinary(key, reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  }
  const char* data = text.empty() ? "" : text.data();
  require(bson_append_utf8(&bson_, key.data(), length(key), data, length(text)));
  return *this;
}

Bson& Bson::add(std::string_view key, const Bson& document) {
  require(bson_append_document(&bson_, key.data(), length(key), &document.bson_));
  return *this;
}

template <typename T>
Bson& Bson::addArray(std::string_view key, const std::vector<T>& values) {
  Bson array;
  for (std::size_t i = 0; i < values.size(); ++i) array.add(std::to_string(i), values[i]);
  require(bson_append_array(&bson_, key.data(), length(key), &array.bson_));
  return *this;
}

Bson& Bson::add(std::string_view key, const std::vector<Bson>& documents) {
  return addArray(key, documents);
}

Bson& Bson::add(std::string_view key, const std::vector<std::string>& texts) {
  return addArray(key, texts);
}

Bson& Bson::add(std::string_view key, const std::vector<std::int64_t>& numbers) {
  return addArray(key, numbers);
}

Bson& Bson::addBinary(std::string_view key, const std::uint8_t* data, std::size_t size) {
  static const std::uint8_t kNothing = 0;
  require(size < (std::size_t{1} << 31) &&
          bson_append_binary(&bson_, key.data(), length(key), BSON_SUBTYPE_BINARY,
                             size == 0 ? &kNothing : data, static_cast<std::uint32_t>(size)));
  return *this;
}

Bson& Bson::addDate(std::string_view key, std::int64_t ms_since_epoch) {
  require(bson_append_date_time(&bson_, key.data(), length(key), ms_since_epoch));
  return *this;
}

Bson& Bson::addNull(std::string_view key) {
  require(bson_append_null(&bson_, key.data(), length(key)));
  return *this;
}

std::string Bson::json() const {
  char* text = bson_as_relaxed_extended_json(&bson_, nullptr);
  const std::string copy = text ? text : "";
  bson_free(text);
  return copy;
}

std::int64_t wallClock_ms() {
  using namespace std::chrono;
  return duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
}

std::optional<std::int64_t> integerAt(const bson_t& document, const char* path) {
  bson_iter_t at;
  if (!find(document, path, at) || !BSON_ITER_HOLDS_NUMBER(&at)) return std::nullopt;
  return bson_iter_as_int64(&at);
}

std::optional<std::int64_t> dateAt(const bson_t& document, const char* path) {
  bson_iter_t at;
  if (!find(document, path, at) || !BSON_ITER_HOLDS_DATE_TIME(&at)) return std::nullopt;
  return bson_iter_date_time(&at);
}

bool isTrueAt(const bson_t& document, const char* path) {
  bson_iter_t at;
  return find(document, path, at) && bson_iter_as_bool(&at);
}

bool hasAt(const bson_t& document, const char* path) {
  bson_iter_t at;
  return find(document, path, at);
}

std::optional<std::string> textAt(const bson_t& document, const char* path) {
  bson_iter_t at;
  if (!find(document, path, at)) return std::nullopt;
  return text(at);
}

std::optional<Bytes> bytesAt(const bson_t& document, const char* path) {
  bson_iter_t at;
  if (!find(document, path, at) || !BSON_ITER_HOLDS_BINARY(&at)) return std::nullopt;
  std::uint32_t size = 0;
  const std::uint8_t* data = nullptr;
  bson_iter_binary(&at, nullptr, &size, &data);
  return Bytes(data, data + size);
}

std::vector<std::string> textsAt(const bson_t& document, const char* path) {
  std::vector<std::string> texts;
  bson_iter_t at, element;
  if (!find(document, path, at) || !BSON_ITER_HOLDS_ARRAY(&at)) return texts;
  if (!bson_iter_recurse(&at, &element)) return texts;
  while (bson_iter_next(&element)) {
    if (auto found = text(element)) texts.push_back(std::move(*found));
  }
  return texts;
}

std::optional<Bson> withoutNonFinite(const bson_t& document) {
  bson_iter_t at;
  if (!bson_iter_init(&at, &document) || !hasNonFinite(at)) return std::nullopt;
  std::optional<Bson> copy(std::in_place);
  copyFinite(at, copy->raw());
  return copy;
}

}  // namespace afterglow::replay
