/// \file
/// The field index: for blocks of consecutive messages of one channel, which values their fields
/// have. It answers for a whole block, mostly without reading a message, whether a filter matches.
/// Internal to replay/store.
///
/// For each scalar field (field_slots.hpp; those in arrays up to kLongestQueriedArray, indices
/// aside) a block has the smallest and the largest number and string, as in
///   G. Moerkotte: Small Materialized Aggregates: A Light Weight Index Structure for Data
///   Warehousing. VLDB 1998 ("zone maps"),
/// and a filter that tells which values do not occur, with one wrong "may occur" in a hundred:
///   B. H. Bloom: Space/Time Trade-offs in Hash Coding with Allowable Errors. CACM 13(7), 1970.
/// Without the filter, the messages of every block whose range holds the value would be read: 700
/// instead of 14 ms for a value that no message of a thousand behaviors has (where_absent_1M of
/// tests/bench/query_bench).
///
/// Two byte strings, numbers little endian:
///   ranges  how many messages (u16; 0: the block has no answers), then for each slot with values,
///           in ascending order: slot (u16), kinds (u8), size of its Bloom filter in bytes (u16);
///           smallest and largest number (f64 each) if there are numbers; first letters of the
///           smallest and of the largest string (u8 length and bytes each) if there are strings
///   bloom   the Bloom filters, one after the other
#pragma once

#include <array>
#include <memory>
#include <string_view>

#include "replay/query/filter.hpp"
#include "replay/store/sqlite/field_slots.hpp"

namespace afterglow::replay {

struct FieldBlock {
  Bytes ranges, bloom;
};

/// Makes blocks of messages of one type.
class FieldBlockWriter {
 public:
  static constexpr std::size_t kMostMessages = 256;
  /// A message with more values leaves its block without an answer.
  static constexpr std::size_t kMostLeaves = 4096;
  /// So does a message with more fields and elements, whether or not they have values: a hostile
  /// definition can have any number of fields that take no bytes.
  static constexpr std::size_t kMostLooks = 1 << 18;
  /// A field with more values in a block has no Bloom filter.
  static constexpr std::size_t kMostValues = 1024;

  explicit FieldBlockWriter(std::shared_ptr<const FieldSlots> slots);

  /// A message that does not fit the definition leaves its block without an answer.
  void add(const Bytes& message);
  std::size_t messages() const { return messages_; }
  /// The block of the messages so far; begins an empty one.
  FieldBlock finish();

 private:
  /// The values of one slot.
  struct Values {
    double least = 0, largest = 0;
    std::string least_text, largest_text;  ///< their first letters
    std::uint8_t kinds = 0;
    std::size_t messages = 0, last_message = 0;  ///< how many have a value; the last that has one
    std::vector<std::uint64_t> hashes;
    std::array<std::uint64_t, 16> recent{};  ///< hashes of late, most of which come again
  };

  void take(class WireReader& reader, const std::vector<FieldSlots::Step>& steps);
  void takeField(WireReader& reader, const FieldSlots::Step& step);
  void takeElement(WireReader& reader, const FieldSlots::Step& step);
  void countLook();
  Values& valuesOf(std::size_t slot);
  void addNumber(std::size_t slot, double number);
  void addText(std::size_t slot, std::string_view text);
  void addHash(Values& values, std::uint64_t hash);
  void put(FieldBlock& block, std::size_t slot, const Values& values) const;

  std::shared_ptr<const FieldSlots> slots_;
  std::vector<Values> values_;  ///< by slot
  std::size_t messages_ = 0, leaves_ = 0, looks_ = 0;
  bool has_answers_ = true;
};

/// How many messages of a block match a condition.
enum class Answer {
  None,   ///< surely none
  Maybe,  ///< unknown: the messages must be read
  Some,   ///< surely at least one
  All     ///< surely all
};

/// A condition over messages of one type, which many blocks answer. Keeps references to both
/// arguments.
class FieldQuestion {
 public:
  FieldQuestion(const FieldSlots& slots, const Condition& condition)
      : slots_(slots), condition_(condition) {}

  /// A damaged block answers Maybe.
  Answer ask(std::string_view ranges, std::string_view bloom);

 private:
  /// The part of a block about one slot.
  struct Range {
    std::size_t slot = 0;
    std::uint8_t kinds = 0;
    double least = 0, largest = 0;
    std::string_view least_text, largest_text;
    std::string_view bloom;  ///< empty: any value may occur
  };

  bool read(std::string_view ranges, std::string_view bloom);
  Answer answer(const Condition& condition, const std::string& prefix, bool in_element);
  Answer answerValue(const Condition& condition, const std::string& path);
  static Answer answerOne(const Range& range, Condition::Op op, const nlohmann::json& operand);
  static Answer answerNumber(const Range& range, Condition::Op op, double number);
  static Answer answerText(const Range& range, Condition::Op op, const std::string& text);

  const FieldSlots& slots_;
  const Condition& condition_;
  std::unordered_map<const Condition*, FieldSlots::Found> found_;
  std::vector<Range> ranges_;  ///< of the block that is asked, in the order of the slots
};

}  // namespace afterglow::replay
