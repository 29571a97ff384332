/// \file
/// Messages as BSON documents, laid out as mongodb_store's msg_to_document does, so that its tools
/// read them: the message's fields are the document's, nested messages are documents in it, time
/// and duration are {secs, nsecs}, uint8[] is Binary, strings are UTF-8 or, where they are not,
/// Binary. Numbers are read in all the forms that writers give them. Needs libbson; for .cpp files
/// of replay and its tests.
#pragma once

#include <bson/bson.h>

#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "replay/messages/document.hpp"

namespace afterglow::replay {

/// The BSON value does not fit the field's type. The text follows the field's name: "is a string
/// instead of an integer". All functions here throw it.
class BsonMismatch : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// "is ... instead of `expected`".
[[noreturn]] void failBsonType(const bson_iter_t& at, std::string_view expected);

/// A value of any type but Message.
Value bsonScalar(FieldType type, const bson_iter_t& at);
Value zeroScalar(FieldType type);

/// Adds an element that is a number.
void addBsonNumber(NumberArray& array, const bson_iter_t& at);

/// The bytes of a string or of binary data: writers use either. Valid as long as the document.
std::string_view bsonBytes(const bson_iter_t& at, std::string_view expected);

struct BsonOptions {
  /// Number arrays longer than this (uint8[] too) become {"type":..., "count":...}, which cannot be
  /// read back. Only for messages whose bytes are kept elsewhere.
  std::size_t longest_array = std::numeric_limits<std::size_t>::max();
};

/// Appends the fields of a decoded message to `bson`. Integers take int32 where they fit, as with
/// pymongo, else int64; a uint64 beyond int64 is its two's complement. A bool that is neither 0 nor
/// 1 is an int32. float32 is a double. All of it reads back bit for bit, except that a signaling
/// NaN of float32 becomes a quiet one. Throws MessageError if `document` is no message or exceeds
/// BSON's 2 GiB; `bson` is then unusable.
void appendBson(const Value& document, bson_t& bson, const BsonOptions& options = {});

struct BsonMessage {
  Value document;  ///< a document of the schema's shape, for encode()
  /// Fields that `bson` lacks, and that are therefore zero or empty; each once, sorted, e.g.
  /// "markers[].header.seq".
  std::vector<std::string> missing;
};

/// The message in a document of any writer: Afterglow, mongodb_log in Python and C++ (whose stamps
/// are dates), message_store. Numbers may be the strings "nan", "inf" and "-inf". Types come from
/// the schema; unknown keys (_id, _meta) are ignored. `bson` is not trusted. Throws MessageError,
/// naming type and field, for a value that the field cannot hold and for damaged BSON.
BsonMessage messageFromBson(const Schema& schema, const bson_t& bson);

}  // namespace afterglow::replay
