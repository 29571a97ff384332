#include <set>

#include "replay/messages/bson_document.hpp"
#include "replay/messages/bson_scalar.hpp"

namespace afterglow::replay {
namespace {

// What is missing is made, so it is limited: a short document must not ask for much memory.
constexpr std::size_t kMostMissing = 1 << 22;

/// Follows the schema, so that the depth of the BSON does not matter; iterators check its lengths.
class BsonReader {
 public:
  explicit BsonReader(const Schema& schema) : schema_(schema) {}

  BsonMessage read(const bson_t& bson) {
    bson_iter_t fields;
    if (!bson_iter_init(&fields, &bson)) fail("is damaged BSON");
    BsonMessage result;
    try {
      result.document = message(0, fields);
    } catch (const BsonMismatch& problem) {
      fail(problem.what());
    }
    result.missing.assign(missing_.begin(), missing_.end());
    return result;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    const std::string at = path();
    throw MessageError("document of " + schema_.root().name + (at.empty() ? "" : ", field " + at) +
                       ": " + what);
  }

  std::string path() const {
    std::string text;
    for (const Field* field : path_) {
      text += (text.empty() ? "" : ".") + field->name;
      const bool is_last = field == path_.back();
      if (field->arity != Field::Arity::Single && !is_last) text += "[]";
    }
    return text;
  }

  Object message(std::size_t type_index, const bson_iter_t& first) {
    const MessageType& type = schema_.types()[type_index];
    Object object;
    object.reserve(type.fields.size());
    bson_iter_t at = first;
    for (const Field& field : type.fields) {
      path_.push_back(&field);
      // Writers keep the definition's order, so the search is a step, most often.
      if (find(at, field) || find(at = first, field)) {
        object.emplace_back(
            field.name, field.arity == Field::Arity::Single ? single(field, at) : array(field, at));
      } else {
        missing_.insert(path());
        object.emplace_back(field.name, zero(field));
        at = first;
      }
      path_.pop_back();
    }
    return object;
  }

  /// Moves to the field, which is there and not null.
  bool find(bson_iter_t& at, const Field& field) const {
    bson_iter_t from = at;
    if (!bson_iter_find(&from, field.name.c_str())) {
      if (from.err_off > 0) fail("is damaged BSON at byte " + std::to_string(from.err_off));
      return false;
    }
    at = from;
    return bson_iter_type(&at) != BSON_TYPE_NULL;
  }

  Value single(const Field& field, const bson_iter_t& at) {
    if (field.type != FieldType::Message) return bsonScalar(field.type, at);
    if (!BSON_ITER_HOLDS_DOCUMENT(&at)) failBsonType(at, schema_.types()[field.message].name);
    return message(field.message, children(at));
  }

  bson_iter_t children(const bson_iter_t& at) const {
    bson_iter_t child;
    if (!bson_iter_recurse(&at, &child)) fail("is damaged BSON");
    return child;
  }

  Value array(const Field& field, const bson_iter_t& at) {
    if (isBsonNumber(field.type)) return numbers(field, at);
    Array elements;
    forEach(field, at,
            [&](const bson_iter_t& element) { elements.push_back(single(field, element)); });
    checkLength(field, elements.size());
    return elements;
  }

  Value numbers(const Field& field, const bson_iter_t& at) {
    NumberArray array{field.type, {}};
    if (field.type == FieldType::UInt8 && !BSON_ITER_HOLDS_ARRAY(&at)) {
      const std::string_view data = bsonBytes(at, "binary data");
      array.bytes.assign(data.begin(), data.end());
    } else {
      forEach(field, at, [&](const bson_iter_t& element) { addBsonNumber(array, element); });
    }
    checkLength(field, array.size());
    return array;
  }

  template <typename Work>
  void forEach(const Field& field, const bson_iter_t& at, const Work& work) {
    if (!BSON_ITER_HOLDS_ARRAY(&at))
      failBsonType(at, "an array of " + std::string(name(field.type)));
    bson_iter_t element = children(at);
    while (bson_iter_next(&element)) work(element);
    if (element.err_off > 0) fail("is damaged BSON");
  }

  void checkLength(const Field& field, std::size_t size) const {
    if (field.arity == Field::Arity::FixedArray && size != field.length) {
      fail("has " + std::to_string(size) + " elements instead of " + std::to_string(field.length));
    }
  }

  // ------------------------------------------------------------------------------ what is missing
  void countMissing(std::size_t more) {
    if (more > kMostMissing - made_) fail("too much of the message is missing");
    made_ += more;
  }

  Value zero(const Field& field) {
    if (field.arity == Field::Arity::Single) return zeroElement(field);
    const std::size_t length = field.arity == Field::Arity::FixedArray ? field.length : 0;
    countMissing(length);
    if (isBsonNumber(field.type))
      return NumberArray{field.type, Bytes(length * fixedSize(field.type))};
    Array elements;
    for (std::size_t i = 0; i < length; ++i) elements.push_back(zeroElement(field));
    return elements;
  }

  Value zeroElement(const Field& field) {
    countMissing(1);
    if (field.type != FieldType::Message) return zeroScalar(field.type);
    Object object;
    for (const Field& inner : schema_.types()[field.message].fields) {
      object.emplace_back(inner.name, zero(inner));
    }
    return object;
  }

  const Schema& schema_;
  std::vector<const Field*> path_;
  std::set<std::string> missing_;
  std::size_t made_ = 0;
};

}  // namespace

BsonMessage messageFromBson(const Schema& schema, const bson_t& bson) {
  return BsonReader(schema).read(bson);
}

}  // namespace afterglow::replay
