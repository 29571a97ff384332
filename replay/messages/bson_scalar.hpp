/// \file
/// Values without fields, read from BSON: what any writer may have made of a type of ROS. Internal
/// to replay/messages.
#pragma once

#include <bson/bson.h>

#include <stdexcept>
#include <string_view>

#include "replay/messages/document.hpp"

namespace afterglow::replay {

/// What is at an iterator is not what the field's type asks for; the text goes on behind a field's
/// name: "is a string instead of an integer". All functions here throw it.
class BsonMismatch : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// "is ... instead of `expected`".
[[noreturn]] void failBsonType(const bson_iter_t& at, std::string_view expected);

/// True for types whose arrays are NumberArrays.
bool isBsonNumber(FieldType type);

/// Of any type but Message.
Value bsonScalar(FieldType type, const bson_iter_t& at);
Value zeroScalar(FieldType type);

/// Adds an element that is a number.
void addBsonNumber(NumberArray& array, const bson_iter_t& at);

/// Of a string or of binary data, which writers took for one another; valid while the document is.
std::string_view bsonBytes(const bson_iter_t& at, std::string_view expected);

}  // namespace afterglow::replay
