/// \file
/// ROS message definitions, parsed at run time: the tree of fields that a definition describes.
/// Source of the grammar and of the concatenated form: genmsg (wiki.ros.org/msg), rosbag's
/// message_definition connection header.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace afterglow::replay {

struct Channel;

/// A definition that cannot be understood, or bytes that do not fit one. The text names the type,
/// the field path and, for bytes, the offset.
class MessageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class FieldType : std::uint8_t {
  Bool,
  Int8,
  UInt8,
  Int16,
  UInt16,
  Int32,
  UInt32,
  Int64,
  UInt64,
  Float32,
  Float64,
  String,
  Time,
  Duration,
  Message
};

/// Serialized size of a scalar of this type; 0 for String and Message.
std::size_t fixedSize(FieldType type);

/// "uint8", "string", ...; "message" for Message.
std::string_view name(FieldType type);

struct Field {
  enum class Arity : std::uint8_t { Single, FixedArray, DynamicArray };
  std::string name;
  FieldType type = FieldType::Bool;
  std::size_t message = 0;  ///< index of a FieldType::Message in Schema::types()
  Arity arity = Arity::Single;
  std::size_t length = 0;  ///< length of a FixedArray
};

struct MessageType {
  std::string name;  ///< "package/Type"
  std::vector<Field> fields;
};

/// A parsed definition; a value, cheap to move, valid once constructed.
class Schema {
 public:
  /// Limits far beyond any real message. They keep a hostile definition from taking stack, memory,
  /// or time with each message: fields without bytes cost time although the message is short.
  static constexpr std::size_t kDeepest = 64;
  static constexpr std::size_t kMostFields = 8192;
  static constexpr std::size_t kMostEmptyFields = 64;
  static constexpr std::size_t kLongestPaths = 4 << 20;  ///< letters, of all fields' paths together

  /// `type` is "package/Type" of the outermost message, `definition` its full text with the
  /// contained types behind lines of '='. Constants and comments are ignored; `byte` and `char`
  /// are int8 and uint8; `Header` is std_msgs/Header, also if the text does not contain it. Throws
  /// MessageError; also for a type that contains itself or goes beyond the limits above.
  static Schema parse(const std::string& type, std::string_view definition);
  /// Returns parse() of a channel's type and definition.
  static Schema of(const Channel& channel);
  /// Null where parse() throws.
  static std::shared_ptr<const Schema> understood(const std::string& type,
                                                  std::string_view definition);

  const std::vector<MessageType>& types() const { return types_; }
  const MessageType& root() const { return types_.front(); }
  /// The fewest bytes that a value of this type can take; array counts are checked against it.
  std::size_t minimumSize(std::size_t type_index) const { return minimum_sizes_[type_index]; }
  /// True if every value of this type takes exactly minimumSize bytes; always if that is 0.
  bool isFixedSize(std::size_t type_index) const { return fixed_sizes_[type_index]; }

 private:
  friend class SchemaParser;
  std::vector<MessageType> types_;  ///< [0] is the outermost
  std::vector<std::size_t> minimum_sizes_;
  std::vector<bool> fixed_sizes_;
};

/// Calls `visit` with every field that is no message, the type it stands in and its path as in
/// FieldPath, "poses[].position.x", in the order of the definition.
void visitFields(const Schema& schema,
                 const std::function<void(const MessageType& type, const Field& field,
                                          const std::string& path)>& visit);

}  // namespace afterglow::replay
