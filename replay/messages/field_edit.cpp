#include "replay/messages/field_edit.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "replay/messages/wire.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int64_t kNanoseconds = 1'000'000'000;

/// Throws MessageError unless the span is of this type and lies within the bytes.
void check(const Bytes& bytes, const FieldSpan& span, FieldType type) {
  if (span.type != type) {
    throw MessageError("field at byte " + std::to_string(span.offset) + " is of type " +
                       std::string(name(span.type)) + ", not " + std::string(name(type)));
  }
  if (span.offset > bytes.size() || span.size > bytes.size() - span.offset) {
    throw MessageError("field at byte " + std::to_string(span.offset) +
                       " lies outside of the message");
  }
}

FieldPath::Step parseStep(std::string_view part, std::string_view whole) {
  const auto refuse = [&] {
    throw MessageError("\"" + std::string(whole) + "\" is no field path; expected e.g. a.b[].c[3]");
  };
  FieldPath::Step step;
  const std::size_t open = std::min(part.find('['), part.size());
  step.name = part.substr(0, open);
  if (step.name.empty() || step.name.find(']') != std::string::npos) refuse();
  std::string_view brackets = part.substr(open);
  if (brackets.empty()) return step;
  step.index = FieldPath::Step::Index::Each;
  if (brackets == "[]") return step;
  step.index = FieldPath::Step::Index::One;
  const auto [end, error] =
      std::from_chars(brackets.data() + 1, brackets.data() + brackets.size(), step.at);
  if (error != std::errc() ||
      std::string_view(end, brackets.data() + brackets.size() - end) != "]") {
    refuse();
  }
  return step;
}

template <typename T>
void writeAs(Bytes& bytes, const FieldSpan& span, double value) {
  if constexpr (std::is_integral_v<T>) {
    // The limits of 64-bit types round up in a double: 2^63 itself must be refused, so compare with
    // the first power of two beyond the range.
    const double beyond = std::ldexp(1.0, std::numeric_limits<T>::digits);
    const double least = std::is_signed_v<T> ? -beyond : 0.0;
    if (!(value >= least && value < beyond) || value != std::trunc(value)) {
      throw MessageError(std::to_string(value) + " is no " + std::string(name(span.type)));
    }
  } else if (std::isfinite(value) && std::abs(value) > std::numeric_limits<T>::max()) {
    throw MessageError(std::to_string(value) + " is too large for a " +
                       std::string(name(span.type)));
  }
  storeNumber(bytes.data() + span.offset, static_cast<T>(value));
}

void collectTimeFields(const Schema& schema, std::size_t type_index, const std::string& prefix,
                       std::vector<FieldPath>& found) {
  for (const Field& field : schema.types()[type_index].fields) {
    const bool array = field.arity != Field::Arity::Single;
    const std::string path = prefix + field.name + (array ? "[]" : "");
    if (field.type == FieldType::Time) found.push_back(FieldPath::parse(path));
    if (field.type == FieldType::Message) {
      collectTimeFields(schema, field.message, path + ".", found);
    }
  }
}

}  // namespace

FieldPath FieldPath::parse(std::string_view text) {
  FieldPath path;
  std::string_view rest = text;
  for (bool more = true; more;) {
    const std::size_t dot = std::min(rest.find('.'), rest.size());
    path.steps_.push_back(parseStep(rest.substr(0, dot), text));
    more = dot < rest.size();
    if (more) rest.remove_prefix(dot + 1);
  }
  return path;
}

std::string FieldPath::str() const {
  std::string text;
  for (const Step& step : steps_) {
    text += (text.empty() ? "" : ".") + step.name;
    if (step.index == Step::Index::Each) text += "[]";
    if (step.index == Step::Index::One) text += "[" + std::to_string(step.at) + "]";
  }
  return text;
}

std::optional<Stamp> readTime(const Bytes& bytes, const FieldSpan& span) {
  if (span.type != FieldType::Time) return std::nullopt;
  check(bytes, span, FieldType::Time);
  const std::uint8_t* at = bytes.data() + span.offset;
  return Stamp::fromParts(loadNumber<std::uint32_t>(at), loadNumber<std::uint32_t>(at + 4));
}

std::string readString(const Bytes& bytes, const FieldSpan& span) {
  check(bytes, span, FieldType::String);
  const std::uint8_t* at = bytes.data() + span.offset;
  return std::string(at + 4, at + span.size);
}

void writeTime(Bytes& bytes, const FieldSpan& span, Stamp stamp) {
  check(bytes, span, FieldType::Time);
  if (stamp.ns < 0 || stamp.ns / kNanoseconds > std::numeric_limits<std::uint32_t>::max()) {
    throw MessageError("ROS time cannot hold a stamp of " + std::to_string(stamp.ns) + " ns");
  }
  std::uint8_t* at = bytes.data() + span.offset;
  storeNumber(at, static_cast<std::uint32_t>(stamp.ns / kNanoseconds));
  storeNumber(at + 4, static_cast<std::uint32_t>(stamp.ns % kNanoseconds));
}

void writeNumber(Bytes& bytes, const FieldSpan& span, double value) {
  check(bytes, span, span.type);
  switch (span.type) {
    case FieldType::Bool:
      if (value != 0 && value != 1) {
        throw MessageError(std::to_string(value) + " is no bool; expected 0 or 1");
      }
      return writeAs<std::uint8_t>(bytes, span, value);
    case FieldType::Int8:
      return writeAs<std::int8_t>(bytes, span, value);
    case FieldType::UInt8:
      return writeAs<std::uint8_t>(bytes, span, value);
    case FieldType::Int16:
      return writeAs<std::int16_t>(bytes, span, value);
    case FieldType::UInt16:
      return writeAs<std::uint16_t>(bytes, span, value);
    case FieldType::Int32:
      return writeAs<std::int32_t>(bytes, span, value);
    case FieldType::UInt32:
      return writeAs<std::uint32_t>(bytes, span, value);
    case FieldType::Int64:
      return writeAs<std::int64_t>(bytes, span, value);
    case FieldType::UInt64:
      return writeAs<std::uint64_t>(bytes, span, value);
    case FieldType::Float32:
      return writeAs<float>(bytes, span, value);
    case FieldType::Float64:
      return writeAs<double>(bytes, span, value);
    default:
      throw MessageError("field at byte " + std::to_string(span.offset) + " is of type " +
                         std::string(name(span.type)) + ", no number");
  }
}

std::size_t editStrings(Bytes& bytes, const std::vector<FieldSpan>& spans,
                        const std::function<std::string(const std::string&)>& edit) {
  Bytes edited;
  std::size_t copied = 0;
  std::size_t changed = 0;
  for (const FieldSpan& span : spans) {
    const std::string before = readString(bytes, span);
    const std::string after = edit(before);
    if (after == before) continue;
    if (after.size() > std::numeric_limits<std::uint32_t>::max()) {
      throw MessageError("a string of " + std::to_string(after.size()) + " bytes fits no message");
    }
    edited.insert(edited.end(), bytes.begin() + static_cast<std::ptrdiff_t>(copied),
                  bytes.begin() + static_cast<std::ptrdiff_t>(span.offset));
    const std::size_t at = edited.size();
    edited.resize(at + 4);
    storeNumber(edited.data() + at, static_cast<std::uint32_t>(after.size()));
    edited.insert(edited.end(), after.begin(), after.end());
    copied = span.offset + span.size;
    ++changed;
  }
  if (changed == 0) return 0;
  edited.insert(edited.end(), bytes.begin() + static_cast<std::ptrdiff_t>(copied), bytes.end());
  bytes = std::move(edited);
  return changed;
}

std::size_t editStrings(const Schema& schema, Bytes& bytes, const FieldPath& path,
                        const std::function<std::string(const std::string&)>& edit) {
  return editStrings(bytes, findField(schema, bytes, path), edit);
}

std::vector<FieldPath> timeFields(const Schema& schema) {
  std::vector<FieldPath> found;
  collectTimeFields(schema, 0, "", found);
  return found;
}

std::optional<Stamp> headerStamp(const Schema& schema, const Bytes& bytes) {
  if (schema.root().fields.empty()) return std::nullopt;
  const Field& first = schema.root().fields.front();
  if (first.type != FieldType::Message || first.arity != Field::Arity::Single) return std::nullopt;
  const std::string& type = schema.types()[first.message].name;
  if (type != "std_msgs/Header" && type != "roslib/Header") return std::nullopt;
  constexpr std::size_t kStampOffset = 4;  // behind seq
  if (bytes.size() < kStampOffset + 8) {
    throw MessageError(schema.root().name + ": ends within its header");
  }
  return readTime(bytes, {FieldType::Time, kStampOffset, 8});
}

}  // namespace afterglow::replay
