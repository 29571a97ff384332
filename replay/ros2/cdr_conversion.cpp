#include "replay/ros2/cdr_conversion.hpp"

#include <algorithm>
#include <cstring>
#include <type_traits>
#include <utility>

#include "replay/messages/text.hpp"
#include "replay/messages/wire.hpp"

namespace afterglow::replay {
namespace {

constexpr std::size_t kEncapsulation = 4;
constexpr std::uint8_t kBigEndian = 0, kLittleEndian = 1;  ///< of the second byte
constexpr std::size_t kLongestPadding = 3;                 ///< behind a message
constexpr std::size_t kFewElements = 64;  ///< without fields may come, however few bytes are left
constexpr std::uint32_t kLastSecond = 0x7fffffff;  ///< of ROS 2, which counts by an int32

/// What is drawn may lack what nothing here draws.
bool isOnlyLookedAt(const std::string& type) { return beginsWith(type, "visualization_msgs/"); }

/// The header's `seq`, which is in no message of ROS 2.
bool hasSequence(const MessageType& type) {
  return type.name == "std_msgs/Header" && !type.fields.empty() && type.fields[0].name == "seq";
}

/// Whether the zeros of a field say that there is none: it is a list, or a message of lists behind
/// a header.
bool saysNone(const Schema& schema, const Field& field) {
  if (field.arity != Field::Arity::Single) return field.arity == Field::Arity::DynamicArray;
  if (field.type != FieldType::Message) return false;
  const MessageType& type = schema.types()[field.message];
  const auto is_fine = [&](const Field& part) {
    const bool is_header =
        part.type == FieldType::Message && schema.types()[part.message].name == "std_msgs/Header";
    return is_header || saysNone(schema, part);
  };
  return type.name != "std_msgs/Header" && !type.fields.empty() &&
         std::all_of(type.fields.begin(), type.fields.end(), is_fine);
}

std::vector<Field>::const_iterator fieldOf(const MessageType& type, const std::string& name) {
  return std::find_if(type.fields.begin(), type.fields.end(),
                      [&](const Field& field) { return field.name == name; });
}

/// Text in a message: without its NUL.
struct Text {
  const std::uint8_t* begin;
  std::size_t size;
};

/// Reads a message of ROS 2 as WireReader does one of ROS 1.
class CdrReader {
 public:
  static constexpr const char* kNoTime = "is a time before 1970, which ROS 1 has not";

  CdrReader(const Schema& schema, const Bytes& bytes) : schema_(schema), bytes_(bytes) {
    const bool is_cdr = bytes.size() >= kEncapsulation && bytes[0] == 0 &&
                        (bytes[1] == kBigEndian || bytes[1] == kLittleEndian);
    if (!is_cdr) fail("is not serialized as ROS 2's nodes do (CDR, version 1)");
    is_swapped_ = bytes[1] == kBigEndian;
    at_ = kEncapsulation;
  }

  std::size_t offset() const { return at_; }
  std::size_t left() const { return bytes_.size() - at_; }
  void seek(std::size_t offset) { at_ = offset; }
  bool isSwapped() const { return is_swapped_; }

  void align(std::size_t size) {
    const std::size_t over = (at_ - kEncapsulation) % size;
    if (over != 0) take(size - over);
  }

  const std::uint8_t* take(std::size_t size) {
    if (size > left()) {
      fail("needs " + std::to_string(size) + " bytes; " + std::to_string(left()) + " are left");
    }
    const std::uint8_t* begin = bytes_.data() + at_;
    at_ += size;
    return begin;
  }

  std::uint32_t number() {
    align(4);
    std::uint8_t bytes[4];
    std::memcpy(bytes, take(4), 4);
    if (is_swapped_) std::reverse(bytes, bytes + 4);
    return loadNumber<std::uint32_t>(bytes);
  }

  Text text() {
    const std::uint32_t size = number();
    if (size == 0) return {nullptr, 0};  // some writers leave out the NUL of an empty one
    const std::uint8_t* text = take(size);
    if (text[size - 1] != 0) fail("is a string that does not end");
    return {text, size - 1};
  }

  std::size_t count(const Field& field) {
    if (field.arity == Field::Arity::Single) return 1;
    if (field.arity == Field::Arity::FixedArray) return field.length;
    const std::size_t count = number();
    // An element has a byte at least, also one without fields.
    if (count > left()) {
      fail("counts " + std::to_string(count) + " elements; " + std::to_string(left()) +
           " bytes are left");
    }
    return count;
  }

  /// IDL has no structure without members.
  void takeEmpty(bool is_outermost) {
    if (left() > 0 || !is_outermost) take(1);
  }

  /// Skips a field that must say that there is none.
  void skipNone(const Field& field) {
    if (!saysNone(schema_, field)) return skipField(field);
    enter(field);
    if (field.arity == Field::Arity::DynamicArray) {
      if (count(field) > 0) fail("is not empty, and ROS 1 has no such field");
    } else {
      for (const Field& part : schema_.types()[field.message].fields) skipNone(part);
    }
    leave();
  }

  void skipField(const Field& field) {
    enter(field);
    const std::size_t elements = count(field), size = fixedSize(field.type);
    if (size > 0) {
      if (elements > 0) align(isNumber(field.type) ? size : 4);
      refuseBeyond(elements, size);
      take(elements * size);
    }
    for (std::size_t i = 0; size == 0 && i < elements; ++i) {
      field.type == FieldType::String ? void(text()) : skipMessage(field.message);
    }
    leave();
  }

  /// Refuses elements that are more than the bytes that are left.
  void refuseBeyond(std::size_t count, std::size_t size) const {
    if (count <= left() / size) return;
    fail("counts " + std::to_string(count) + " elements of " + std::to_string(size) + " bytes; " +
         std::to_string(left()) + " are left");
  }

  void finish() const {
    if (left() > kLongestPadding) {
      fail(std::to_string(left()) + " bytes are left behind the message's last field");
    }
  }

  void enter(const Field& field) { path_.push_back(&field); }
  void atElement(std::size_t) {}
  void leave() { path_.pop_back(); }
  [[noreturn]] void fail(const std::string& what) const {
    std::string path;
    for (const Field* field : path_) path += (path.empty() ? "" : ".") + field->name;
    throw MessageError(schema_.root().name + (path.empty() ? "" : ", field " + path) +
                       ", at byte " + std::to_string(at_) + ": " + what);
  }

 private:
  void skipMessage(std::size_t index) {
    const MessageType& type = schema_.types()[index];
    if (type.fields.empty()) return takeEmpty(false);
    for (const Field& field : type.fields) {
      const bool is_sequence = hasSequence(type) && &field == type.fields.data();
      if (!is_sequence) skipField(field);
    }
  }

  const Schema& schema_;
  const Bytes& bytes_;
  std::size_t at_ = 0;
  bool is_swapped_ = false;
  std::vector<const Field*> path_;  ///< from the outermost field inwards
};

class Ros1Reader : public WireReader {
 public:
  static constexpr const char* kNoTime = "is a time after 2038, which ROS 2 has not";
  using WireReader::WireReader;

  static bool isSwapped() { return false; }
  void align(std::size_t) {}
  void takeEmpty(bool) {}
  void refuseBeyond(std::size_t, std::size_t) const {}  // count() has done so
  std::uint32_t number() { return WireReader::number<std::uint32_t>(); }
  std::size_t count(const Field& field) {
    const std::size_t count = WireReader::count(field);
    // Elements without fields take no bytes here, and one each in ROS 2.
    if (field.type == FieldType::Message && count > std::max(left(), kFewElements)) {
      fail("counts " + std::to_string(count) + " elements; " + std::to_string(left()) +
           " bytes are left");
    }
    return count;
  }
  Text text() {
    const std::uint32_t size = number();
    return {take(size), size};
  }
};

/// What both writers have in common.
class Writer {
 public:
  explicit Writer(std::size_t size) { bytes_.reserve(size); }
  void put(const std::uint8_t* bytes, std::size_t size) {
    bytes_.insert(bytes_.end(), bytes, bytes + size);
  }
  void putZeros(std::size_t size) { bytes_.resize(bytes_.size() + size); }
  Bytes::iterator end() { return bytes_.end(); }
  Bytes take() { return std::move(bytes_); }

 protected:
  void putNumber(std::uint32_t number) {
    std::uint8_t bytes[sizeof(number)];
    storeNumber(bytes, number);
    put(bytes, sizeof(number));
  }
  Bytes bytes_;
};

class Ros1Writer : public Writer {
 public:
  using Writer::Writer;
  void align(std::size_t) {}
  void number(std::uint32_t number) { putNumber(number); }
  void text(const Text& text) {
    number(static_cast<std::uint32_t>(text.size));
    put(text.begin, text.size);
  }
  void empty() {}
};

class CdrWriter : public Writer {
 public:
  explicit CdrWriter(std::size_t size) : Writer(size) { bytes_ = {0, kLittleEndian, 0, 0}; }
  void align(std::size_t size) {
    const std::size_t over = (bytes_.size() - kEncapsulation) % size;
    if (over != 0) putZeros(size - over);
  }
  void number(std::uint32_t number) {
    align(4);
    putNumber(number);
  }
  void text(const Text& text) {
    number(static_cast<std::uint32_t>(text.size + 1));
    put(text.begin, text.size);
    putZeros(1);
  }
  void empty() { putZeros(1); }
};

}  // namespace

// --------------------------------------------------------------------------------------- the walk

/// One message on its way.
template <typename From, typename To>
class CdrWalk {
 public:
  static constexpr bool kToRos1 = std::is_same_v<To, Ros1Writer>;

  CdrWalk(const CdrConversion& conversion, const Bytes& bytes)
      : conversion_(conversion),
        from_(kToRos1 ? conversion.ros2_ : conversion.ros1_, bytes),
        to_(bytes.size() + bytes.size() / 8 + 64) {}

  Bytes walk(CdrConversion::Rest rest) {
    copyMessage(0);
    if (rest == CdrConversion::Rest::Refused) from_.finish();
    return to_.take();
  }

 private:
  using Link = CdrConversion::Link;
  using Type = CdrConversion::Type;

  static std::size_t sourceOf(const Link& link) { return kToRos1 ? link.ros2 : link.ros1; }
  static std::size_t targetOf(const Link& link) { return kToRos1 ? link.ros1 : link.ros2; }
  const MessageType& sourceType(const Type& type) const {
    return kToRos1 ? conversion_.ros2_.types()[type.ros2] : conversion_.ros1_.types()[type.ros1];
  }
  const MessageType& targetType(const Type& type) const {
    return kToRos1 ? conversion_.ros1_.types()[type.ros1] : conversion_.ros2_.types()[type.ros2];
  }

  void copyMessage(std::size_t index) {
    const Type& type = conversion_.types_[index];
    if (conversion_.ros2_.types()[type.ros2].fields.empty()) {
      from_.takeEmpty(index == 0);
      return to_.empty();
    }
    if (!type.is_in_order) return copyInOtherOrder(type);
    for (const Link& link : type.links) copyLink(type, link);
  }

  void copyLink(const Type& type, const Link& link) {
    const std::size_t source = sourceOf(link), target = targetOf(link);
    if (source == CdrConversion::kNone) return putNothing(targetType(type), target);
    const Field& field = sourceType(type).fields[source];
    return target == CdrConversion::kNone ? skipExtra(field) : copyField(field, link);
  }

  void skipExtra(const Field& field) {
    if constexpr (kToRos1) {
      if (conversion_.extra_ == CdrConversion::Extra::Empty) return from_.skipNone(field);
    }
    from_.skipField(field);
  }

  /// Every field is looked for once before any is copied.
  void copyInOtherOrder(const Type& type) {
    std::vector<std::size_t> begins(sourceType(type).fields.size());
    for (const Link& link : kToRos1 ? type.links : type.in_ros1_order) {
      const std::size_t source = sourceOf(link);
      if (source == CdrConversion::kNone) continue;
      begins[source] = from_.offset();
      const Field& field = sourceType(type).fields[source];
      targetOf(link) == CdrConversion::kNone ? skipExtra(field) : from_.skipField(field);
    }
    const std::size_t end = from_.offset();
    for (const Link& link : kToRos1 ? type.in_ros1_order : type.links) {
      if (targetOf(link) == CdrConversion::kNone) continue;
      if (sourceOf(link) != CdrConversion::kNone) from_.seek(begins[sourceOf(link)]);
      copyLink(type, link);
    }
    from_.seek(end);
  }

  void copyField(const Field& field, const Link& link) {
    from_.enter(field);
    const std::size_t count = from_.count(field);
    if (field.arity == Field::Arity::DynamicArray) {
      refuseMore(count, link.bound.elements, "elements");
      to_.number(static_cast<std::uint32_t>(count));
    }
    const CdrConversion::Uniform uniform = conversion_.uniformOf(field, link);
    if (uniform.number_size != 0) {
      from_.refuseBeyond(count, uniform.size);
      copyNumbers(uniform.number_size, count * uniform.size);
    } else {
      for (std::size_t i = 0; i < count; ++i) {
        from_.atElement(i);
        copyElement(field, link);
      }
    }
    from_.leave();
  }

  void copyElement(const Field& field, const Link& link) {
    switch (field.type) {
      case FieldType::String: {
        const Text text = from_.text();
        refuseMore(text.size, link.bound.letters, "letters");
        return to_.text(text);
      }
      case FieldType::Time:
        return copyTime();
      case FieldType::Duration:
        return copyNumbers(4, 8);
      default:
        return copyMessage(link.type);
    }
  }

  void copyTime() {
    const std::uint32_t seconds = from_.number();
    if (seconds > kLastSecond) from_.fail(From::kNoTime);
    to_.number(seconds);
    to_.number(from_.number());
  }

  /// Copies `size` bytes of numbers of `number_size` each.
  void copyNumbers(std::size_t number_size, std::size_t size) {
    if (size == 0) return;
    from_.align(number_size);
    to_.align(number_size);
    to_.put(from_.take(size), size);
    if (!from_.isSwapped() || number_size == 1) return;
    const auto each = static_cast<std::ptrdiff_t>(number_size);
    for (auto at = to_.end() - static_cast<std::ptrdiff_t>(size); at != to_.end(); at += each) {
      std::reverse(at, at + each);
    }
  }

  /// A field that the other side has not.
  void putNothing(const MessageType& type, std::size_t index) {
    const Field& field = type.fields[index];
    if (field.arity == Field::Arity::DynamicArray) return to_.number(0);
    std::size_t count = field.arity == Field::Arity::FixedArray ? field.length : 1;
    for (; count > 0; --count) putNothing(field);
  }
  void putNothing(const Field& field) {
    if (field.type == FieldType::String) return to_.text({nullptr, 0});
    if (field.type != FieldType::Message) {
      const std::size_t size = fixedSize(field.type);
      to_.align(isNumber(field.type) ? size : 4);
      return to_.putZeros(size);
    }
    const MessageType& type = conversion_.ros2_.types()[field.message];
    if (type.fields.empty()) return to_.empty();
    for (std::size_t i = hasSequence(type) ? 1 : 0; i < type.fields.size(); ++i) {
      putNothing(type, i);
    }
  }

  void refuseMore(std::size_t count, std::size_t bound, const char* what) const {
    if (kToRos1 || bound == 0 || count <= bound) return;
    from_.fail("has " + std::to_string(count) + " " + what + "; ROS 2 takes " +
               std::to_string(bound));
  }

  const CdrConversion& conversion_;
  From from_;
  To to_;
};

Bytes CdrConversion::toRos1(const Bytes& cdr, Rest rest) const {
  return CdrWalk<CdrReader, Ros1Writer>(*this, cdr).walk(rest);
}

Bytes CdrConversion::toRos2(const Bytes& ros1) const {
  return CdrWalk<Ros1Reader, CdrWriter>(*this, ros1).walk(Rest::Refused);
}

// --------------------------------------------------------------------------------------- the plan

CdrConversion::CdrConversion(Schema ros2, Schema ros1, const Ros2Bounds& bounds, Extra extra)
    : ros2_(std::move(ros2)), ros1_(std::move(ros1)), extra_(extra) {
  plan(0, 0, "", bounds);
}

/// Returns the place of a pair of types, which is planned once.
std::size_t CdrConversion::plan(std::size_t ros2, std::size_t ros1, const std::string& path,
                                const Ros2Bounds& bounds) {
  const auto is_known = [&](const Type& type) { return type.ros2 == ros2 && type.ros1 == ros1; };
  const auto known = std::find_if(types_.begin(), types_.end(), is_known);
  if (known != types_.end()) return static_cast<std::size_t>(known - types_.begin());
  const std::size_t place = types_.size();
  types_.push_back({ros2, ros1, {}, {}, true, {}});
  Type type = types_[place];
  const bool has_sequence = hasSequence(ros2_.types()[ros2]);
  if (has_sequence) type.links.push_back({kNone, 0, kNone, {}});
  for (std::size_t i = has_sequence ? 1 : 0; i < ros2_.types()[ros2].fields.size(); ++i) {
    type.links.push_back(linkOf(type, i, path, bounds));
  }
  checkAllFound(type, path);
  type.in_ros1_order = type.links;
  const auto isBefore = [](const Link& a, const Link& b) { return a.ros1 < b.ros1; };
  std::stable_sort(type.in_ros1_order.begin(), type.in_ros1_order.end(), isBefore);
  std::size_t last = 0;
  for (const Link& link : type.links) {
    if (link.ros1 == kNone) continue;
    type.is_in_order = type.is_in_order && link.ros1 >= last;
    last = link.ros1;
  }
  type.uniform = uniformOf(type);
  types_[place] = std::move(type);
  return place;
}

CdrConversion::Link CdrConversion::linkOf(const Type& type, std::size_t ros2,
                                          const std::string& path, const Ros2Bounds& bounds) {
  const MessageType& from = ros2_.types()[type.ros2];
  const MessageType& to = ros1_.types()[type.ros1];
  const Field& source = from.fields[ros2];
  std::string name = nameInRos1(to.name, source.name);
  auto target = fieldOf(to, name);
  if (target == to.fields.end()) target = fieldOf(to, name = source.name);
  Link link;
  link.ros2 = ros2;
  if (target == to.fields.end()) {
    if (!isAllowedExtra(to, source)) throw MessageError("ROS 1 has no field " + path + source.name);
    return link;
  }
  link.ros1 = static_cast<std::size_t>(target - to.fields.begin());
  if (source.type != target->type || source.arity != target->arity ||
      source.length != target->length) {
    throw MessageError("field " + path + name + " is of another type in ROS 2");
  }
  if (source.arity == Field::Arity::FixedArray && source.length == 0) {
    throw MessageError("field " + path + name + " is an array of no elements, which ROS 2 has not");
  }
  const auto bound = bounds.find({from.name, source.name});
  if (bound != bounds.end()) link.bound = bound->second;
  if (source.type == FieldType::Message) {
    link.type = plan(source.message, target->message, path + name + ".", bounds);
  }
  return link;
}

bool CdrConversion::isAllowedExtra(const MessageType& owner, const Field& field) const {
  return isOnlyLookedAt(owner.name) || extra_ == Extra::PassedOver ||
         (extra_ == Extra::Empty && saysNone(ros2_, field));
}

void CdrConversion::checkAllFound(const Type& type, const std::string& path) const {
  const std::vector<Field>& fields = ros1_.types()[type.ros1].fields;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto isFound = [&](const Link& link) { return link.ros1 == i; };
    if (std::none_of(type.links.begin(), type.links.end(), isFound)) {
      throw MessageError("ROS 2 has no field " + path + fields[i].name);
    }
  }
}

CdrConversion::Uniform CdrConversion::uniformOf(const Field& field, const Link& link) const {
  if (field.type == FieldType::Message) return types_[link.type].uniform;
  if (!isNumber(field.type)) return {};
  return {fixedSize(field.type), fixedSize(field.type)};
}

CdrConversion::Uniform CdrConversion::uniformOf(const Type& type) const {
  constexpr std::size_t kLargest = std::size_t{1} << 32;
  const std::vector<Field>& fields = ros2_.types()[type.ros2].fields;
  Uniform whole;
  for (const Link& link : type.links) {
    if (!type.is_in_order || link.ros2 == kNone || link.ros1 == kNone) return {};
    const Field& field = fields[link.ros2];
    const Uniform part = uniformOf(field, link);
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

}  // namespace afterglow::replay
