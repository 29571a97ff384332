#include <cmath>
#include <optional>

#include "replay/messages/wire.hpp"
#include "replay/query/field_block.hpp"
#include "replay/query/field_index.hpp"

namespace afterglow::replay {
namespace {

using namespace field_block;
using nlohmann::json;
using Op = Condition::Op;

Answer both(Answer a, Answer b) {
  if (a == Answer::None || b == Answer::None) return Answer::None;
  if (a == Answer::All) return b;
  if (b == Answer::All) return a;
  return Answer::Maybe;  // some and some need not be the same
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

template <typename T>
int compare(const T& a, const T& b) {
  return a < b ? -1 : b < a ? 1 : 0;
}

bool isUpwards(Op op) { return op == Op::Greater || op == Op::GreaterEqual; }

/// Of an operand's place beside the smallest and the largest value (-1 below, 0 at, 1 above it).
/// `is_exact`: 0 means equal. `is_pure`: every message has such values and no others.
Answer answerOrder(Op op, int to_least, int to_largest, bool is_exact, bool is_pure) {
  if (!isUpwards(op)) {  // the same, upside down
    const Op mirrored = op == Op::Less ? Op::Greater : Op::GreaterEqual;
    return answerOrder(mirrored, -to_largest, -to_least, is_exact, is_pure);
  }
  if (to_largest > 0) return Answer::None;
  const bool with_equal = op == Op::GreaterEqual;
  if (to_largest == 0 && !is_exact) return Answer::Maybe;
  if (to_largest == 0 && !with_equal) return Answer::None;
  const bool is_below_all = to_least < 0 || (to_least == 0 && is_exact && with_equal);
  return is_pure && is_below_all ? Answer::All : Answer::Some;
}

Answer answerEqual(int to_least, int to_largest, bool is_exact, bool is_pure) {
  if (to_least < 0 || to_largest > 0) return Answer::None;
  if (!is_exact || (to_least != 0 && to_largest != 0)) return Answer::Maybe;
  return is_pure && to_least == 0 && to_largest == 0 ? Answer::All : Answer::Some;
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

std::optional<double> specialNumber(const std::string& text) {
  if (text == "nan") return std::nan("");
  if (text == "inf") return HUGE_VAL;
  if (text == "-inf") return -HUGE_VAL;
  return std::nullopt;
}

bool asksForNull(const Condition& condition) {
  if (condition.op == Op::Exists || condition.op == Op::Element) return false;
  if (condition.op != Op::In) return condition.operand.is_null();
  return std::any_of(condition.operand.begin(), condition.operand.end(),
                     [](const json& operand) { return operand.is_null(); });
}

Answer answerBool(std::uint8_t kinds, Op op, bool operand) {
  Answer answer = Answer::None;
  for (const bool value : {false, true}) {
    const std::uint8_t kind = value ? kTrue : kFalse;
    const bool holds = op == Op::Equal       ? value == operand
                       : op == Op::Less      ? value < operand
                       : op == Op::LessEqual ? value <= operand
                       : op == Op::Greater   ? value > operand
                                             : value >= operand;
    if (!holds || (kinds & kind) == 0) continue;
    answer = either(answer, kinds == (kind | kAlways) ? Answer::All : Answer::Some);
  }
  return answer;
}

/// Takes a block's parts from the front of its bytes.
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
    T value{};
    if (is_good_) std::memcpy(&value, taken.data(), sizeof(T));
    return value;
  }
  std::string_view text() { return take(number<std::uint8_t>()); }
  bool isGood() const { return is_good_; }
  bool isDone() const { return bytes_.empty(); }

 private:
  std::string_view bytes_;
  bool is_good_ = true;
};

}  // namespace

FieldQuestion::FieldQuestion(const FieldSlots& slots, const Condition& condition)
    : slots_(slots), condition_(condition) {}

Answer FieldQuestion::ask(std::string_view ranges, std::string_view values) {
  if (!read(ranges, values)) return Answer::Maybe;
  return answer(condition_, "", false);
}

/// False: the block has no answers.
bool FieldQuestion::read(std::string_view ranges, std::string_view values) {
  ranges_.clear();
  Taker from(ranges), blooms(values);
  if (from.number<std::uint16_t>() == 0) return false;
  while (!from.isDone() && from.isGood()) {
    Range range;
    range.slot = from.number<std::uint16_t>();
    range.kinds = from.number<std::uint8_t>();
    const auto bloom_size = from.number<std::uint16_t>();
    if ((range.kinds & kNumber) != 0) {
      range.least = from.number<double>();
      range.largest = from.number<double>();
    }
    if ((range.kinds & kText) != 0) {
      range.least_text = from.text();
      range.largest_text = from.text();
    }
    if (!values.empty()) range.bloom = blooms.take(bloom_size);
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
      // What holds for an element holds for its message, but not for every element of it.
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
  const auto range =
      std::lower_bound(ranges_.begin(), ranges_.end(), place.slot,
                       [](const Range& known, std::size_t slot) { return known.slot < slot; });
  const bool has_values = range != ranges_.end() && range->slot == place.slot;
  if (condition.op == Op::Exists) {
    if (place.is_array) return Answer::Maybe;
    if (!has_values) return Answer::None;
    return (range->kinds & kAlways) != 0 ? Answer::All : Answer::Some;
  }
  const json& operand = condition.operand;
  if (condition.op == Op::Matches) {
    const bool has_text = has_values && (range->kinds & (kText | kForeignText)) != 0;
    return has_text ? Answer::Maybe : Answer::None;
  }
  const Range none;
  const Range& asked = has_values ? *range : none;
  if (condition.op != Op::In) return answerOne(asked, condition.op, operand);
  Answer any = Answer::None;
  for (const json& element : operand) any = either(any, answerOne(asked, Op::Equal, element));
  return any;
}

Answer FieldQuestion::answerOne(const Range& range, Op op, const json& operand) {
  if (operand.is_boolean()) return answerBool(range.kinds, op, operand.get<bool>());
  if (operand.is_number()) return answerNumber(range, op, operand.get<double>());
  if (!operand.is_string()) return Answer::Maybe;
  const auto& text = operand.get_ref<const std::string&>();
  const Answer answer = answerText(range, op, text);
  const auto number = specialNumber(text);
  return number && op != Op::Equal ? either(answer, answerNumber(range, op, *number)) : answer;
}

Answer FieldQuestion::answerNumber(const Range& range, Op op, double number) {
  Answer answer = Answer::None;
  if ((range.kinds & kNumber) != 0 && !std::isnan(number)) {
    const int to_least = compare(number, range.least), to_largest = compare(number, range.largest);
    const bool is_exact = std::abs(number) < kExactIntegers || std::isinf(number);
    const bool is_pure = range.kinds == (kNumber | kAlways);
    answer = op == Op::Equal ? answerEqual(to_least, to_largest, is_exact, is_pure)
                             : answerOrder(op, to_least, to_largest, is_exact, is_pure);
    if (op == Op::Equal && answer == Answer::Maybe && isRuledOut(range.bloom, hashOf(number))) {
      answer = Answer::None;
    }
  }
  // Infinite numbers are in there as texts.
  if (op != Op::Equal && std::isfinite(number)) {
    answer = either(answer, answerText(range, Op::Equal, isUpwards(op) ? "inf" : "-inf"));
  }
  return answer;
}

Answer FieldQuestion::answerText(const Range& range, Op op, const std::string& text) {
  Answer answer = Answer::None;
  if ((range.kinds & kText) != 0) {
    const std::string_view start = std::string_view(text).substr(0, kRangeLetters);
    const int to_least = compare(start, range.least_text);
    const int to_largest = compare(start, range.largest_text);
    const bool is_exact = text.size() < kRangeLetters;
    const bool is_pure = range.kinds == (kText | kAlways);
    answer = op == Op::Equal ? answerEqual(to_least, to_largest, is_exact, is_pure)
                             : answerOrder(op, to_least, to_largest, is_exact, is_pure);
    if (op == Op::Equal && answer == Answer::Maybe && isRuledOut(range.bloom, hashOf(text))) {
      answer = Answer::None;
    }
  }
  const bool is_open = (range.kinds & kForeignText) != 0 && answer == Answer::None;
  return is_open ? Answer::Maybe : answer;
}

}  // namespace afterglow::replay
