#include "replay/ros2/cdr_message.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include "replay/messages/wire.hpp"

namespace afterglow::replay {
namespace {

constexpr std::size_t kEncapsulation = 4;
constexpr std::uint8_t kBigEndian = 0, kLittleEndian = 1;  ///< of the second byte
constexpr std::size_t kLongestPadding = 3;                 ///< behind a message

}  // namespace

/// One message on its way.
class CdrWalk {
 public:
  CdrWalk(const CdrMessage& message, const std::uint8_t* bytes, std::size_t size)
      : schema_(message.schema_), message_(message), bytes_(bytes), size_(size) {
    const bool is_cdr = size >= kEncapsulation && bytes[0] == 0 &&
                        (bytes[1] == kBigEndian || bytes[1] == kLittleEndian);
    if (!is_cdr) fail("is not serialized as ROS 2's nodes do (CDR, version 1)");
    is_swapped_ = bytes[1] == kBigEndian;
    at_ = kEncapsulation;
    ros1_.reserve(size + 16);
  }

  Bytes walk() {
    copyMessage(0);
    if (left() > kLongestPadding) {
      fail(std::to_string(left()) + " bytes are left behind the message's last field");
    }
    return std::move(ros1_);
  }

 private:
  std::size_t left() const { return size_ - at_; }

  void align(std::size_t size) {
    const std::size_t over = (at_ - kEncapsulation) % size;
    if (over != 0) take(size - over);
  }

  const std::uint8_t* take(std::size_t size) {
    if (size > left()) {
      fail("needs " + std::to_string(size) + " bytes; " + std::to_string(left()) + " are left");
    }
    const std::uint8_t* begin = bytes_ + at_;
    at_ += size;
    return begin;
  }

  void put(const std::uint8_t* bytes, std::size_t size) {
    ros1_.insert(ros1_.end(), bytes, bytes + size);
  }
  void put(std::uint32_t number) {
    std::uint8_t bytes[sizeof(number)];
    storeNumber(bytes, number);
    put(bytes, sizeof(number));
  }

  std::uint32_t number() {
    align(4);
    std::uint8_t bytes[4];
    std::memcpy(bytes, take(4), 4);
    if (is_swapped_) std::reverse(bytes, bytes + 4);
    return loadNumber<std::uint32_t>(bytes);
  }

  /// `size` bytes of numbers of `number_size` each.
  void copyNumbers(std::size_t number_size, std::size_t size) {
    if (size == 0) return;
    align(number_size);
    const std::uint8_t* begin = take(size);
    const std::size_t written = ros1_.size();
    put(begin, size);
    if (!is_swapped_ || number_size == 1) return;
    for (auto at = ros1_.begin() + static_cast<std::ptrdiff_t>(written); at != ros1_.end();
         at += static_cast<std::ptrdiff_t>(number_size)) {
      std::reverse(at, at + static_cast<std::ptrdiff_t>(number_size));
    }
  }

  void copyString() {
    const std::uint32_t size = number();
    if (size == 0) return put(std::uint32_t{0});  // some writers leave out the NUL of an empty one
    const std::uint8_t* text = take(size);
    if (text[size - 1] != 0) fail("is a string that does not end");
    put(size - 1);
    put(text, size - 1);
  }

  void copyTime() {
    const std::uint32_t seconds = number();
    if (seconds > 0x7fffffff) fail("is a time before 1970, which ROS 1 has not");
    put(seconds);
    put(number());
  }

  void copyElement(const Field& field) {
    switch (field.type) {
      case FieldType::String:
        return copyString();
      case FieldType::Time:
        return copyTime();
      case FieldType::Duration:
        return copyNumbers(4, 8);
      case FieldType::Message:
        return copyMessage(field.message);
      default:
        return copyNumbers(fixedSize(field.type), fixedSize(field.type));
    }
  }

  void copyField(const Field& field) {
    path_.push_back(&field);
    std::size_t count = 1;
    if (field.arity == Field::Arity::FixedArray) count = field.length;
    if (field.arity == Field::Arity::DynamicArray) {
      count = number();
      // An element has a byte at least, also one without fields.
      if (count > left()) {
        fail("counts " + std::to_string(count) + " elements; " + std::to_string(left()) +
             " bytes are left");
      }
      put(static_cast<std::uint32_t>(count));
    }
    const CdrMessage::Uniform uniform = uniformOf(field);
    if (uniform.number_size != 0) {
      if (count > left() / uniform.size) {
        fail("counts " + std::to_string(count) + " elements of " + std::to_string(uniform.size) +
             " bytes; " + std::to_string(left()) + " are left");
      }
      copyNumbers(uniform.number_size, count * uniform.size);
    } else {
      for (std::size_t i = 0; i < count; ++i) copyElement(field);
    }
    path_.pop_back();
  }

  CdrMessage::Uniform uniformOf(const Field& field) const {
    if (field.type == FieldType::Message) return message_.uniform_[field.message];
    if (!isNumber(field.type)) return {};
    return {fixedSize(field.type), fixedSize(field.type)};
  }

  void copyMessage(std::size_t type) {
    const std::vector<Field>& fields = schema_.types()[type].fields;
    if (fields.empty()) {
      if (left() > 0 || type != 0) take(1);  // IDL has no structure without members
      return;
    }
    if (message_.is_header_[type]) put(std::uint32_t{0});
    for (const Field& field : fields) {
      const bool is_sequence = message_.is_header_[type] && &field == fields.data();
      if (!is_sequence) copyField(field);
    }
  }

  [[noreturn]] void fail(const std::string& what) const {
    std::string path;
    for (const Field* field : path_) path += (path.empty() ? "" : ".") + field->name;
    throw MessageError(schema_.root().name + (path.empty() ? "" : ", field " + path) +
                       ", at byte " + std::to_string(at_) + ": " + what);
  }

  const Schema& schema_;
  const CdrMessage& message_;
  const std::uint8_t* bytes_;
  const std::size_t size_;
  std::size_t at_ = 0;
  bool is_swapped_ = false;
  Bytes ros1_;
  std::vector<const Field*> path_;  ///< from the outermost field inwards
};

CdrMessage::CdrMessage(Schema schema)
    : schema_(std::move(schema)),
      uniform_(schema_.types().size()),
      is_header_(schema_.types().size()) {
  std::vector<bool> is_known(schema_.types().size());
  measure(0, is_known);
}

/// And all types that it contains, once.
void CdrMessage::measure(std::size_t type, std::vector<bool>& is_known) {
  if (is_known[type]) return;
  is_known[type] = true;
  const MessageType& described = schema_.types()[type];
  for (const Field& field : described.fields) {
    if (field.type == FieldType::Message) measure(field.message, is_known);
  }
  is_header_[type] = described.name == "std_msgs/Header" && !described.fields.empty() &&
                     described.fields[0].name == "seq";
  uniform_[type] = uniformOf(described);
}

CdrMessage::Uniform CdrMessage::uniformOf(const MessageType& type) const {
  constexpr std::size_t kLargest = std::size_t{1} << 32;
  Uniform whole;
  for (const Field& field : type.fields) {
    Uniform part;
    if (field.type == FieldType::Message) part = uniform_[field.message];
    if (isNumber(field.type)) part = {fixedSize(field.type), fixedSize(field.type)};
    const std::size_t count = field.arity == Field::Arity::FixedArray ? field.length : 1;
    const bool fits = part.number_size != 0 && field.arity != Field::Arity::DynamicArray &&
                      count <= kLargest / part.size &&
                      (whole.number_size == 0 || whole.number_size == part.number_size);
    if (!fits) return {};
    whole.number_size = part.number_size;
    whole.size += count * part.size;
    if (whole.size > kLargest) return {};
  }
  // An array of no elements has none to divide by.
  return whole.size == 0 ? Uniform{} : whole;
}

Bytes CdrMessage::toRos1(const std::uint8_t* bytes, std::size_t size) const {
  return CdrWalk(*this, bytes, size).walk();
}

}  // namespace afterglow::replay
