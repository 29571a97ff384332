/// \file
/// Values without fields, read from BSON in all the forms that writers give the types of ROS.
/// Internal to replay/messages.
#pragma once

#include <bson/bson.h>

#include <stdexcept>
#include <string_view>

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

}  // namespace afterglow::replay
