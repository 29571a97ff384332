/// \file
/// The field index: for blocks of consecutive messages of one channel, which values their fields
/// take. It answers for a whole block, mostly without reading a message, whether a filter matches.
///
/// A block keeps for every scalar field (field_slots.hpp; in arrays up to kLongestQueriedArray,
/// indices aside) the smallest and the largest number and string, as in
///   G. Moerkotte: Small Materialized Aggregates: A Light Weight Index Structure for Data
///   Warehousing. VLDB 1998 ("zone maps"),
/// and which values occur, with one wrong yes in a hundred, as in
///   B. H. Bloom: Space/Time Trade-offs in Hash Coding with Allowable Errors. CACM 13(7), 1970.
/// Internal to replay/store.
#pragma once

#include <array>
#include <memory>
#include <string_view>

#include "replay/query/field_slots.hpp"
#include "replay/query/filter.hpp"

namespace afterglow::replay {

/// What a block is on disk, in two parts: ranges are small and always read, values (the Bloom
/// filters) only where the ranges leave an answer open.
struct FieldBlock {
  Bytes ranges, values;
};

/// Makes a block of messages.
class FieldBlockWriter {
 public:
  static constexpr std::size_t kMostMessages = 256;
  /// A message with more values leaves its block without an answer.
  static constexpr std::size_t kMostLeaves = 4096;
  /// So does one with more fields to look at for them: a definition can make any number of nothing.
  static constexpr std::size_t kMostLooks = 1 << 18;
  /// A field with more values in a block has its range alone.
  static constexpr std::size_t kMostValues = 1024;

  explicit FieldBlockWriter(std::shared_ptr<const FieldSlots> slots);

  /// One that does not fit the definition leaves its block without an answer.
  void add(const Bytes& message);
  std::size_t messages() const { return messages_; }
  /// The block of the messages so far; begins an empty one.
  FieldBlock finish();

 private:
  struct Values {
    double least = 0, largest = 0;
    std::string least_text, largest_text;  ///< their first letters
    std::uint8_t kinds = 0;
    std::uint32_t messages = 0, last_message = 0;  ///< how many have it; the last that has
    std::vector<std::uint64_t> hashes;
    std::array<std::uint64_t, 16> recent{};  ///< hashes seen lately: values repeat
  };

  void take(class WireReader& reader, const std::vector<FieldSlots::Step>& steps);
  void takeField(WireReader& reader, const FieldSlots::Step& step);
  void takeElement(WireReader& reader, const FieldSlots::Step& step);
  void countLook();
  Values& valuesOf(std::size_t slot);
  void addNumber(std::size_t slot, double number);
  void addText(std::size_t slot, std::string_view text);
  void addHash(Values& values, std::uint64_t hash);
  void putRanges(Bytes& to, std::size_t slot, const Values& values, std::size_t bloom_size) const;

  std::shared_ptr<const FieldSlots> slots_;
  std::vector<Values> values_;
  std::size_t messages_ = 0, leaves_ = 0, looks_ = 0;
  bool has_answers_ = true;
};

/// Of the messages of a block, those that match a condition.
enum class Answer {
  None,   ///< surely
  Maybe,  ///< one must look
  Some,   ///< at least one, surely
  All     ///< surely
};

/// A condition over messages of one type, to be asked of many blocks. Keeps references to both.
class FieldQuestion {
 public:
  FieldQuestion(const FieldSlots& slots, const Condition& condition);

  /// `values` may be empty: then only the ranges are asked. A block that is damaged answers Maybe.
  Answer ask(std::string_view ranges, std::string_view values);

 private:
  /// What a block says of a slot.
  struct Range {
    std::size_t slot = 0;
    std::uint8_t kinds = 0;
    double least = 0, largest = 0;
    std::string_view least_text, largest_text;
    std::string_view bloom;  ///< empty: unknown
  };

  Answer answer(const Condition& condition, const std::string& prefix, bool in_element);
  Answer answerValue(const Condition& condition, const std::string& path);
  static Answer answerOne(const Range& range, Condition::Op op, const nlohmann::json& operand);
  static Answer answerNumber(const Range& range, Condition::Op op, double number);
  static Answer answerText(const Range& range, Condition::Op op, const std::string& text);
  bool read(std::string_view ranges, std::string_view values);

  const FieldSlots& slots_;
  const Condition& condition_;
  std::unordered_map<const Condition*, FieldSlots::Found> found_;
  std::vector<Range> ranges_;  ///< of the block that is asked, in the order of the slots
};

}  // namespace afterglow::replay
