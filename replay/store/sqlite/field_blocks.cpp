#include "replay/store/sqlite/field_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include "replay/messages/wire.hpp"

namespace afterglow::replay {
namespace {

using nlohmann::json;
using Op = Condition::Op;
using Step = FieldSlots::Step;

/// The kinds of values that a slot has, and whether it has one in every message.
enum Kind : std::uint8_t {
  kNumber = 1,  ///< finite; others are "nan", "inf" and "-inf", as in the documents of filters
  kText = 4,
  kFalse = 8,
  kTrue = 16,
  kAlways = 32,
  kForeignText = 64,  ///< a string that is not ASCII: neither its range nor its hash is known
};

/// Letters of a string that its range has (std::string keeps so many without an allocation), and
/// those that its hash is made of.
constexpr std::size_t kRangeLetters = 15;
constexpr std::size_t kHashedLetters = 64;

constexpr std::size_t kBitsPerValue = 10;
constexpr int kHashes = 7;

/// Larger integers are rounded in a double.
constexpr double kExactIntegers = 9007199254740992.0;

// ------------------------------------------------------------------------------------------ hashes

/// splitmix64's finalizer (Steele, Lea, Flood: Fast Splittable Pseudorandom Number Generators,
/// OOPSLA 2014).
std::uint64_t mixed(std::uint64_t bits) {
  bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9u;
  bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebu;
  return bits ^ (bits >> 31);
}

std::uint64_t hashOf(double number) {
  const double canonical = number == 0 ? 0.0 : number;  // no negative zero
  std::uint64_t bits;
  std::memcpy(&bits, &canonical, sizeof(bits));
  return mixed(bits + 0x9e3779b97f4a7c15u);
}

std::uint64_t hashOf(std::string_view text) {
  std::uint64_t hash = 0x51ed270b0a1f39c1u;
  text = text.substr(0, kHashedLetters);
  for (std::size_t at = 0; at < text.size(); at += 8) {
    std::uint64_t letters = 0;
    std::memcpy(&letters, text.data() + at, std::min<std::size_t>(8, text.size() - at));
    hash = mixed(hash ^ letters) + at;
  }
  return mixed(hash + text.size());
}

/// Calls visit(bit) for the bits of a value in a Bloom filter of so many bytes. All hashes are made
/// from one, as in A. Kirsch, M. Mitzenmacher: Less Hashing, Same Performance. ESA 2006.
template <typename Visit>
void forBits(std::uint64_t hash, std::size_t bytes, const Visit& visit) {
  const std::uint64_t bits = bytes * 8;
  const auto step = static_cast<std::uint32_t>(hash >> 32) | 1;
  auto at = static_cast<std::uint32_t>(hash);
  for (int i = 0; i < kHashes; ++i, at += step) visit(at * bits >> 32);
}

bool isRuledOut(std::string_view bloom, std::uint64_t hash) {
  bool is_missing = false;
  if (bloom.empty()) return false;
  forBits(hash, bloom.size(), [&](std::size_t bit) {
    const auto byte = static_cast<unsigned char>(bloom[bit / 8]);
    is_missing = is_missing || (byte >> (bit % 8) & 1) == 0;
  });
  return is_missing;
}

/// Of the letters that count. A document replaces those that are no UTF-8.
bool isAscii(std::string_view text) {
  const std::string_view start = text.substr(0, kHashedLetters);
  return std::none_of(start.begin(), start.end(), [](char c) { return (c & 0x80) != 0; });
}

// ----------------------------------------------------------------------------------------- writing

template <typename T>
void putValue(Bytes& to, T value) {
  const std::size_t at = to.size();
  to.resize(at + sizeof(T));
  storeNumber(to.data() + at, value);
}

void putText(Bytes& to, const std::string& text) {
  putValue(to, static_cast<std::uint8_t>(text.size()));
  to.insert(to.end(), text.begin(), text.end());
}

/// Appends the Bloom filter of these hashes and returns its size.
std::size_t putBloom(Bytes& to, const std::vector<std::uint64_t>& hashes) {
  const std::size_t begin = to.size(), size = (hashes.size() * kBitsPerValue + 7) / 8;
  to.resize(begin + size);
  for (const std::uint64_t hash : hashes) {
    forBits(hash, size, [&](std::size_t bit) {
      to[begin + bit / 8] |= static_cast<std::uint8_t>(1u << (bit % 8));
    });
  }
  return size;
}

double numberOf(WireReader& reader, FieldType type) {
  return withNumber(
      type, [&](auto zero) { return static_cast<double>(reader.number<decltype(zero)>()); });
}

// ----------------------------------------------------------------------------------------- answers

Answer both(Answer a, Answer b) {
  if (a == Answer::None || b == Answer::None) return Answer::None;
  if (a == Answer::All) return b;
  if (b == Answer::All) return a;
  return Answer::Maybe;  // some messages and some messages need not be the same
}

Answer either(Answer a, Answer b) {
  if (a == Answer::All || b == Answer::All) return Answer::All;
  if (a == Answer::None) return b;
  if (b == Answer::None) return a;
  return a == Answer::Some || b == Answer::Some ? Answer::Some : Answer::Maybe;
}

Answer opposite(Answer a) {
  if (a == Answer::None) return Answer::All;
  return a == Answer::All ? Answer::None : Answer::Maybe;
}

/// Where an operand lies beside the smallest and the largest value: -1 below, 0 at, 1 above it.
struct OperandPlace {
  int to_least, to_largest;
  bool is_exact;  ///< 0 means that they are equal
  bool is_pure;   ///< every message has values of this kind and no others
};

template <typename T>
int compare(const T& a, const T& b) {
  return a < b ? -1 : b < a ? 1 : 0;
}

bool isUpwards(Op op) { return op == Op::Greater || op == Op::GreaterEqual; }

Answer answerPlace(Op op, const OperandPlace& at) {
  if (op == Op::Equal) {
    if (at.to_least < 0 || at.to_largest > 0) return Answer::None;
    if (!at.is_exact || (at.to_least != 0 && at.to_largest != 0)) return Answer::Maybe;
    return at.is_pure && at.to_least == 0 && at.to_largest == 0 ? Answer::All : Answer::Some;
  }
  if (!isUpwards(op)) {  // the same, upside down
    const Op mirrored = op == Op::Less ? Op::Greater : Op::GreaterEqual;
    return answerPlace(mirrored, {-at.to_largest, -at.to_least, at.is_exact, at.is_pure});
  }
  if (at.to_largest > 0) return Answer::None;
  const bool with_equal = op == Op::GreaterEqual;
  if (at.to_largest == 0 && !at.is_exact) return Answer::Maybe;
  if (at.to_largest == 0 && !with_equal) return Answer::None;
  const bool is_below_all = at.to_least < 0 || (at.to_least == 0 && at.is_exact && with_equal);
  return at.is_pure && is_below_all ? Answer::All : Answer::Some;
}

Answer answerBool(std::uint8_t kinds, Op op, bool operand) {
  if ((kinds & (kFalse | kTrue)) == 0) return Answer::None;
  const bool least = (kinds & kFalse) == 0, largest = (kinds & kTrue) != 0;
  const bool is_pure = (kinds | kFalse | kTrue) == (kFalse | kTrue | kAlways);
  return answerPlace(op, {compare(operand, least), compare(operand, largest), true, is_pure});
}

bool isSpecialNumber(const std::string& text) {
  return text == "nan" || text == "inf" || text == "-inf";
}

bool asksForNull(const Condition& condition) {
  if (condition.op == Op::Exists || condition.op == Op::Element) return false;
  if (condition.op != Op::In) return condition.operand.is_null();
  return std::any_of(condition.operand.begin(), condition.operand.end(),
                     [](const json& operand) { return operand.is_null(); });
}

/// Takes the parts of a block from the front of its bytes.
class Taker {
 public:
  explicit Taker(std::string_view bytes) : bytes_(bytes) {}
  std::string_view take(std::size_t size) {
    is_good_ = is_good_ && size <= bytes_.size();
    if (!is_good_) return {};
    const std::string_view taken = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return taken;
  }
  template <typename T>
  T number() {
    const std::string_view taken = take(sizeof(T));
    return is_good_ ? loadNumber<T>(reinterpret_cast<const std::uint8_t*>(taken.data())) : T{};
  }
  std::string_view text() { return take(number<std::uint8_t>()); }
  bool isGood() const { return is_good_; }
  bool isDone() const { return bytes_.empty(); }

 private:
  std::string_view bytes_;
  bool is_good_ = true;
};

}  // namespace

// ---------------------------------------------------------------------------------- block's writer

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
    values.last_message = messages_;
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
  if ((values.kinds & kNumber) == 0) values.least = values.largest = number;
  values.kinds |= kNumber;
  values.least = std::min(values.least, number);
  values.largest = std::max(values.largest, number);
  addHash(values, hashOf(number));
}

void FieldBlockWriter::addText(std::size_t slot, std::string_view text) {
  Values& values = valuesOf(slot);
  if (!isAscii(text)) {
    values.kinds |= kForeignText;
    return;
  }
  const std::string_view start = text.substr(0, kRangeLetters);
  if ((values.kinds & kText) == 0) values.least_text = values.largest_text = start;
  values.kinds |= kText;
  if (start < values.least_text) values.least_text = start;
  if (start > values.largest_text) values.largest_text = start;
  addHash(values, hashOf(text));
}

void FieldBlockWriter::addHash(Values& values, std::uint64_t hash) {
  std::uint64_t& seen = values.recent[hash % values.recent.size()];
  if ((seen == hash && hash != 0) || values.hashes.size() > kMostValues) return;
  seen = hash;
  values.hashes.push_back(hash);
}

void FieldBlockWriter::put(FieldBlock& block, std::size_t slot, const Values& values) const {
  // The range tells a single value.
  const bool has_bloom = values.hashes.size() > 1 && values.hashes.size() <= kMostValues;
  const std::size_t bloom_size = has_bloom ? putBloom(block.bloom, values.hashes) : 0;
  const bool is_always = values.messages == messages_;
  putValue(block.ranges, static_cast<std::uint16_t>(slot));
  putValue(block.ranges, static_cast<std::uint8_t>(values.kinds | (is_always ? kAlways : 0)));
  putValue(block.ranges, static_cast<std::uint16_t>(bloom_size));
  if ((values.kinds & kNumber) != 0) {
    putValue(block.ranges, values.least);
    putValue(block.ranges, values.largest);
  }
  if ((values.kinds & kText) != 0) {
    putText(block.ranges, values.least_text);
    putText(block.ranges, values.largest_text);
  }
}

FieldBlock FieldBlockWriter::finish() {
  FieldBlock block;
  putValue(block.ranges, static_cast<std::uint16_t>(has_answers_ ? messages_ : 0));
  for (std::size_t slot = 0; slot < values_.size(); ++slot) {
    Values& values = values_[slot];
    if (values.messages > 0 && has_answers_) put(block, slot, values);
    values.kinds = 0;
    values.messages = values.last_message = 0;
    values.hashes.clear();
    values.recent.fill(0);
  }
  messages_ = 0;
  has_answers_ = true;
  return block;
}

// -------------------------------------------------------------------------------- block's answers

Answer FieldQuestion::ask(std::string_view ranges, std::string_view bloom) {
  return read(ranges, bloom) ? answer(condition_, "", false) : Answer::Maybe;
}

/// False: the block has no answers.
bool FieldQuestion::read(std::string_view ranges, std::string_view bloom) {
  ranges_.clear();
  Taker from(ranges), blooms(bloom);
  if (from.number<std::uint16_t>() == 0) return false;
  while (!from.isDone() && from.isGood()) {
    Range range;
    range.slot = from.number<std::uint16_t>();
    range.kinds = from.number<std::uint8_t>();
    range.bloom = blooms.take(from.number<std::uint16_t>());
    if ((range.kinds & kNumber) != 0) {
      range.least = from.number<double>();
      range.largest = from.number<double>();
    }
    if ((range.kinds & kText) != 0) {
      range.least_text = from.text();
      range.largest_text = from.text();
    }
    ranges_.push_back(range);
  }
  return from.isGood() && blooms.isGood();
}

Answer FieldQuestion::answer(const Condition& condition, const std::string& prefix,
                             bool in_element) {
  switch (condition.kind) {
    case Condition::Kind::All: {
      Answer all = Answer::All;
      for (const auto& part : condition.parts) all = both(all, answer(part, prefix, in_element));
      return all;
    }
    case Condition::Kind::Any:
    case Condition::Kind::None: {
      Answer any = Answer::None;
      for (const auto& part : condition.parts) any = either(any, answer(part, prefix, in_element));
      return condition.kind == Condition::Kind::Any ? any : opposite(any);
    }
    case Condition::Kind::Value: {
      const bool is_inner = !prefix.empty() && !condition.path.empty();
      const Answer value = answerValue(condition, prefix + (is_inner ? "." : "") + condition.path);
      // A sure answer about all elements is no sure answer about the one that the path names.
      const bool is_partial = in_element || found_.at(&condition).has_index;
      return is_partial && value != Answer::None ? Answer::Maybe : value;
    }
    case Condition::Kind::Topic:
      break;
  }
  return Answer::Maybe;
}

Answer FieldQuestion::answerValue(const Condition& condition, const std::string& path) {
  auto found = found_.find(&condition);
  if (found == found_.end()) found = found_.emplace(&condition, slots_.find(path)).first;
  const FieldSlots::Found place = found->second;
  if (place.place == FieldSlots::Place::Nowhere) {
    return asksForNull(condition) ? Answer::Maybe : Answer::None;
  }
  if (condition.op == Op::Element) {
    const Answer inner = answer(condition.parts.front(), path, true);
    return inner == Answer::None ? Answer::None : Answer::Maybe;
  }
  if (place.place == FieldSlots::Place::Unknown || asksForNull(condition)) return Answer::Maybe;
  const auto at =
      std::lower_bound(ranges_.begin(), ranges_.end(), place.slot,
                       [](const Range& known, std::size_t slot) { return known.slot < slot; });
  const Range range = at != ranges_.end() && at->slot == place.slot ? *at : Range{};
  switch (condition.op) {
    case Op::Exists:
      if (place.is_array) return Answer::Maybe;
      if (range.kinds == 0) return Answer::None;
      return (range.kinds & kAlways) != 0 ? Answer::All : Answer::Some;
    case Op::Matches:
      return (range.kinds & (kText | kForeignText)) != 0 ? Answer::Maybe : Answer::None;
    case Op::In: {
      Answer any = Answer::None;
      for (const json& one : condition.operand) any = either(any, answerOne(range, Op::Equal, one));
      return any;
    }
    default:
      return answerOne(range, condition.op, condition.operand);
  }
}

Answer FieldQuestion::answerOne(const Range& range, Op op, const json& operand) {
  if (operand.is_boolean()) return answerBool(range.kinds, op, operand.get<bool>());
  if (operand.is_number()) return answerNumber(range, op, operand.get<double>());
  if (!operand.is_string()) return Answer::Maybe;
  const auto& text = operand.get_ref<const std::string&>();
  const bool may_be_number = op != Op::Equal && isSpecialNumber(text);
  return may_be_number ? Answer::Maybe : answerText(range, op, text);
}

Answer FieldQuestion::answerNumber(const Range& range, Op op, double number) {
  Answer answer = Answer::None;
  if ((range.kinds & kNumber) != 0) {
    const bool is_exact = std::abs(number) < kExactIntegers;
    const bool is_pure = range.kinds == (kNumber | kAlways);
    answer = answerPlace(op, {compare(number, range.least), compare(number, range.largest),
                              is_exact, is_pure});
    if (op == Op::Equal && answer == Answer::Maybe && isRuledOut(range.bloom, hashOf(number))) {
      answer = Answer::None;
    }
  }
  // Infinite numbers are in the block as texts.
  if (op == Op::Equal) return answer;
  return either(answer, answerText(range, Op::Equal, isUpwards(op) ? "inf" : "-inf"));
}

Answer FieldQuestion::answerText(const Range& range, Op op, const std::string& text) {
  Answer answer = Answer::None;
  if ((range.kinds & kText) != 0) {
    const std::string_view start = std::string_view(text).substr(0, kRangeLetters);
    const bool is_exact = text.size() < kRangeLetters;
    const bool is_pure = range.kinds == (kText | kAlways);
    answer = answerPlace(op, {compare(start, range.least_text), compare(start, range.largest_text),
                              is_exact, is_pure});
    if (op == Op::Equal && answer == Answer::Maybe && isRuledOut(range.bloom, hashOf(text))) {
      answer = Answer::None;
    }
  }
  const bool is_open = (range.kinds & kForeignText) != 0 && answer == Answer::None;
  return is_open ? Answer::Maybe : answer;
}

}  // namespace afterglow::replay
