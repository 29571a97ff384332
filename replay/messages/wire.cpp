#include "replay/messages/wire.hpp"

namespace afterglow::replay {

WireReader::WireReader(const Schema& schema, const Bytes& bytes) : schema_(schema), bytes_(bytes) {
  path_.reserve(8);
  if (bytes.size() < schema.minimumSize(0)) {
    fail("holds " + std::to_string(bytes.size()) +
         " bytes; no message of this type has fewer than " + std::to_string(schema.minimumSize(0)));
  }
}

const std::uint8_t* WireReader::take(std::size_t size) {
  if (size > left()) {
    fail("needs " + std::to_string(size) + " bytes; " + std::to_string(left()) + " are left");
  }
  const std::uint8_t* at = bytes_.data() + offset_;
  offset_ += size;
  return at;
}

std::string WireReader::string() {
  const auto size = number<std::uint32_t>();
  const std::uint8_t* at = take(size);
  return std::string(at, at + size);
}

std::size_t WireReader::minimumSize(const Field& field) const {
  if (field.type == FieldType::Message) return schema_.minimumSize(field.message);
  return field.type == FieldType::String ? sizeof(std::uint32_t) : fixedSize(field.type);
}

std::size_t WireReader::count(const Field& field) {
  if (field.arity == Field::Arity::Single) return 1;
  const std::size_t count =
      field.arity == Field::Arity::FixedArray ? field.length : number<std::uint32_t>();
  const std::size_t each = minimumSize(field);
  if (each > 0 && count > left() / each) {
    fail("counts " + std::to_string(count) + " elements of at least " + std::to_string(each) +
         " bytes; " + std::to_string(left()) + " are left");
  }
  return count;
}

void WireReader::skipElement(const Field& field) {
  switch (field.type) {
    case FieldType::String:
      take(number<std::uint32_t>());
      break;
    case FieldType::Message:
      skipMessage(field.message);
      break;
    default:
      take(fixedSize(field.type));
  }
}

void WireReader::skipMessage(std::size_t type_index) {
  if (schema_.isFixedSize(type_index)) {
    take(schema_.minimumSize(type_index));
    return;
  }
  for (const Field& field : schema_.types()[type_index].fields) skipField(field);
}

void WireReader::skipField(const Field& field) {
  enter(field);
  const std::size_t elements = count(field);
  const bool same_size = field.type == FieldType::Message ? schema_.isFixedSize(field.message)
                                                          : field.type != FieldType::String;
  if (same_size) {
    take(elements * minimumSize(field));  // cannot overflow after count()
  } else {
    for (std::size_t i = 0; i < elements; ++i) {
      atElement(i);
      skipElement(field);
    }
  }
  leave();
}

void WireReader::finish() const {
  if (left() > 0) fail(std::to_string(left()) + " bytes are left behind the message's last field");
}

void WireReader::fail(const std::string& what) const {
  std::string path;
  for (const Place& place : path_) {
    path += (path.empty() ? "" : ".") + place.field->name;
    if (place.field->arity != Field::Arity::Single) path += "[" + std::to_string(place.index) + "]";
  }
  throw MessageError(schema_.root().name + (path.empty() ? "" : ", field " + path) + ", at byte " +
                     std::to_string(offset_) + ": " + what);
}

}  // namespace afterglow::replay
