#include <cmath>

#include "replay/messages/wire.hpp"
#include "replay/query/field_block.hpp"
#include "replay/query/field_index.hpp"

namespace afterglow::replay {
namespace {

using namespace field_block;
using Step = FieldSlots::Step;

template <typename T>
void putValue(Bytes& to, T value) {
  const std::size_t at = to.size();
  to.resize(at + sizeof(T));
  std::memcpy(to.data() + at, &value, sizeof(T));
}

void putText(Bytes& to, const std::string& text) {
  putValue(to, static_cast<std::uint8_t>(text.size()));
  to.insert(to.end(), text.begin(), text.end());
}

double numberOf(WireReader& reader, FieldType type) {
  switch (type) {
    case FieldType::Int8:
      return reader.number<std::int8_t>();
    case FieldType::UInt8:
      return reader.number<std::uint8_t>();
    case FieldType::Int16:
      return reader.number<std::int16_t>();
    case FieldType::UInt16:
      return reader.number<std::uint16_t>();
    case FieldType::Int32:
      return reader.number<std::int32_t>();
    case FieldType::UInt32:
      return reader.number<std::uint32_t>();
    case FieldType::Int64:
      return static_cast<double>(reader.number<std::int64_t>());
    case FieldType::UInt64:
      return static_cast<double>(reader.number<std::uint64_t>());
    case FieldType::Float32:
      return reader.number<float>();
    default:
      return reader.number<double>();
  }
}

std::size_t bloomSize(std::size_t values) { return (values * kBitsPerValue + 7) / 8; }

}  // namespace

FieldBlockWriter::FieldBlockWriter(std::shared_ptr<const FieldSlots> slots)
    : slots_(std::move(slots)), values_(slots_->size()) {}

void FieldBlockWriter::add(const Bytes& message) {
  ++messages_;
  leaves_ = looks_ = 0;
  if (!has_answers_) return;
  try {
    WireReader reader(slots_->schema(), message);
    take(reader, slots_->steps());
    reader.finish();
  } catch (const MessageError&) {
    has_answers_ = false;
  }
}

void FieldBlockWriter::take(WireReader& reader, const std::vector<Step>& steps) {
  for (const Step& step : steps) takeField(reader, step);
}

void FieldBlockWriter::takeField(WireReader& reader, const Step& step) {
  countLook();
  const Field& field = *step.field;
  if (step.slot == FieldSlots::kNone && step.below.empty()) return reader.skipField(field);
  if (field.arity == Field::Arity::Single) return takeElement(reader, step);
  const std::size_t begin = reader.offset();
  const std::size_t count = reader.count(field);
  if (count > kLongestQueriedArray) {
    reader.seek(begin);
    reader.skipField(field);
    addText(step.type_slot, name(field.type));
    addNumber(step.count_slot, static_cast<double>(count));
    return;
  }
  for (std::size_t i = 0; i < count; ++i) takeElement(reader, step);
}

void FieldBlockWriter::takeElement(WireReader& reader, const Step& step) {
  countLook();
  switch (step.field->type) {
    case FieldType::Message:
      return take(reader, step.below);
    case FieldType::Bool:
      valuesOf(step.slot).kinds |= reader.number<std::uint8_t>() != 0 ? kTrue : kFalse;
      return;
    case FieldType::String: {
      const auto size = reader.number<std::uint32_t>();
      const auto* letters = reinterpret_cast<const char*>(reader.take(size));
      return addText(step.slot, {letters, size});
    }
    case FieldType::Time:
    case FieldType::Duration: {
      const bool is_signed = step.field->type == FieldType::Duration;
      const FieldType part = is_signed ? FieldType::Int32 : FieldType::UInt32;
      addNumber(step.slot, numberOf(reader, part));
      return addNumber(step.slot + 1, numberOf(reader, part));
    }
    default:
      addNumber(step.slot, numberOf(reader, step.field->type));
  }
}

void FieldBlockWriter::countLook() {
  if (++looks_ > kMostLooks) throw MessageError("more fields than the field index looks at");
}

FieldBlockWriter::Values& FieldBlockWriter::valuesOf(std::size_t slot) {
  if (++leaves_ > kMostLeaves) throw MessageError("more values than the field index takes");
  Values& values = values_[slot];
  if (values.last_message != messages_) {
    values.last_message = static_cast<std::uint32_t>(messages_);
    ++values.messages;
  }
  return values;
}

void FieldBlockWriter::addNumber(std::size_t slot, double number) {
  if (!std::isfinite(number)) {
    addText(slot, std::isnan(number) ? "nan" : number > 0 ? "inf" : "-inf");
    return;
  }
  Values& values = valuesOf(slot);
  if ((values.kinds & kNumber) == 0) {
    values.kinds |= kNumber;
    values.least = values.largest = number;
  } else if (number < values.least) {
    values.least = number;
  } else if (number > values.largest) {
    values.largest = number;
  }
  addHash(values, hashOf(number));
}

void FieldBlockWriter::addText(std::size_t slot, std::string_view text) {
  Values& values = valuesOf(slot);
  if (!isAscii(text)) {
    values.kinds |= kForeignText;
    return;
  }
  const std::string_view start = text.substr(0, kRangeLetters);
  if ((values.kinds & kText) == 0) {
    values.kinds |= kText;
    values.least_text = values.largest_text = start;
  } else if (start < values.least_text) {
    values.least_text = start;
  } else if (start > values.largest_text) {
    values.largest_text = start;
  }
  addHash(values, hashOf(text));
}

void FieldBlockWriter::addHash(Values& values, std::uint64_t hash) {
  std::uint64_t& seen = values.recent[hash % values.recent.size()];
  if ((seen == hash && hash != 0) || values.hashes.size() > kMostValues) return;
  seen = hash;
  values.hashes.push_back(hash);
}

void FieldBlockWriter::putRanges(Bytes& to, std::size_t slot, const Values& values,
                                 std::size_t bloom_size) const {
  const bool is_always = values.messages == messages_;
  putValue(to, static_cast<std::uint16_t>(slot));
  putValue(to, static_cast<std::uint8_t>(values.kinds | (is_always ? kAlways : 0)));
  putValue(to, static_cast<std::uint16_t>(bloom_size));
  if ((values.kinds & kNumber) != 0) {
    putValue(to, values.least);
    putValue(to, values.largest);
  }
  if ((values.kinds & kText) != 0) {
    putText(to, values.least_text);
    putText(to, values.largest_text);
  }
}

FieldBlock FieldBlockWriter::finish() {
  FieldBlock block;
  putValue(block.ranges, static_cast<std::uint16_t>(has_answers_ ? messages_ : 0));
  for (std::size_t slot = 0; slot < values_.size(); ++slot) {
    Values& values = values_[slot];
    if (values.messages > 0 && has_answers_) {
      // One value is told by its range.
      const bool has_bloom = values.hashes.size() > 1 && values.hashes.size() <= kMostValues;
      const std::size_t size = has_bloom ? bloomSize(values.hashes.size()) : 0;
      putRanges(block.ranges, slot, values, size);
      const std::size_t begin = block.values.size();
      block.values.resize(begin + size);
      for (std::size_t i = 0; has_bloom && i < values.hashes.size(); ++i) {
        forBits(values.hashes[i], size, [&](std::size_t bit) {
          block.values[begin + bit / 8] |= static_cast<std::uint8_t>(1u << (bit % 8));
        });
      }
    }
    values.kinds = 0;
    values.messages = values.last_message = 0;
    values.hashes.clear();
    values.recent.fill(0);
  }
  messages_ = 0;
  has_answers_ = true;
  return block;
}

}  // namespace afterglow::replay
