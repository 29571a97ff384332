/// \file
/// Filters in MongoDB's query language, over behaviors and over messages. They decide in every
/// store, whatever its indexes say, so that all stores give the same answers.
///
/// Operators: $eq $ne $gt $gte $lt $lte $in $nin $exists $regex ($options i, m, s, x) $not
/// $elemMatch on a field; $and $or $nor $not around filters. Several fields, and several operators
/// on one field, must all hold. A field is a dotted path through objects and arrays; a number in it
/// is an array's index.
///
/// Semantics, MongoDB's (mongodb.com/docs/manual/tutorial/query-arrays, .../query-for-null-fields,
/// .../reference/bson-type-comparison-order):
/// - A condition holds for an array if it holds for an element or for the array as a whole; a path
///   goes through every element of the arrays on its way. $ne, $nin and $not hold where $eq, $in
///   and the negated condition do not.
/// - Values are compared with values of their kind only: numbers of every type with numbers
///   (exactly), strings with strings (byte by byte), booleans with booleans (false < true).
/// - null equals null and a missing value. {"$exists": false} holds where the path leads nowhere.
/// - NaN equals NaN, and is neither less nor greater than anything.
/// Differences to MongoDB: JSON has no NaN and no infinities, so documents and filters have them as
/// the strings "nan", "inf" and "-inf", which count as that number and as that string. Objects are
/// equal whatever the order of their fields. $gt, $gte, $lt, $lte take no arrays and objects.
///
/// Over a message the document is messageDocument()'s. Over a behavior it is behaviorDocument()'s,
/// and a field that begins with "/" is a topic: {"/cmd_vel": {"linear.x": {"$gt": 0.5}}} holds if
/// at least one message on it, in the behavior's interval of its recording, matches the filter over
/// messages, {"/t": {"$exists": false}} if there is no message on it.
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "replay/messages/document.hpp"
#include "replay/messages/schema.hpp"
#include "replay/query/regular_expression.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// The $regex of a filter: Perl's, by the library that MongoDB has, too (PCRE2).
class TextPattern {
 public:
  /// `options`: i (case aside), m (^ and $ at every line), s (. takes line breaks), x (blanks are
  /// not part of it). Throws FilterError, with the place in the pattern.
  TextPattern(const std::string& pattern, const std::string& options);

  /// True if the text has a match. Throws FilterError for a pattern that takes too long, as nested
  /// repetitions do.
  bool isIn(const std::string& text) const;

 private:
  std::string pattern_;
  RegularExpression expression_;
};

/// A text that is no filter; one line with the place in it and the reason.
class FilterError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Arrays longer than this are {"type", "count"} in the documents that filters see.
constexpr std::size_t kLongestQueriedArray = 64;

/// A node of a filter: a condition on one document. A value; a server is asked what it says.
struct Condition {
  enum class Kind {
    All,    ///< all parts hold
    Any,    ///< a part or more holds
    None,   ///< no part does
    Value,  ///< `op` holds for a value at `path`
    Topic,  ///< a message or more on topic `path` matches the one part
  };
  enum class Op { Equal, Less, LessEqual, Greater, GreaterEqual, In, Exists, Matches, Element };

  Kind kind = Kind::All;
  std::vector<Condition> parts;  ///< Op::Element has one, which an element of the array must match
  std::string path;
  Op op = Op::Equal;
  /// The value to compare with; In: an array of values. Of a Topic: the filter over messages, as it
  /// was written.
  nlohmann::json operand;
  std::shared_ptr<const TextPattern> pattern;  ///< pattern of Op::Matches

  /// Judges a document; the condition holds no Topic. Throws FilterError (a pattern that takes too
  /// long).
  bool matches(const nlohmann::json& document) const;
  /// The empty condition, which holds for everything.
  bool isEmpty() const { return kind == Kind::All && parts.empty(); }
  /// Returns true if the answer depends on messages: a Topic is in it.
  bool asksTopics() const;
};

/// A parsed filter.
class Filter {
 public:
  enum class Over { Behaviors, Messages };
  /// Throws FilterError; over behaviors also for a field that behaviors do not have.
  static Filter parse(const std::string& text, Over over = Over::Behaviors);

  /// Judges a message's document, for a filter over messages.
  bool matches(const nlohmann::json& document) const { return root_.matches(document); }

  /// Returns true if a message on the topic, in the interval and the recording of the behavior,
  /// matches.
  using AnyMessage = std::function<bool(const std::string& topic, const Condition& condition)>;
  /// Judges a behavior. Its own fields are looked at first: `any_message` is asked only if they
  /// leave the answer open.
  bool matches(const Behavior& behavior, const AnyMessage& any_message) const;

  const Condition& root() const { return root_; }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
  Condition root_;
  std::set<std::string> fields_;  ///< the fields of a behavior that it reads
};

/// A behavior's fields as filters see them: id, key, recording, name, tree_path, parent, attempt,
/// outcome, begin, end, wall_begin (nanoseconds; a filter may write a time such as
/// "2026-11-21T09:30:00Z" instead; begin_ns, end_ns, wall_begin_ns are the same), duration_s,
/// robot, parameters, tags, calibration, topics, snapshot, remarks. One without an end has no end
/// and no duration_s. Only the fields in `wanted`, if it names any.
nlohmann::json behaviorDocument(const Behavior& behavior, const std::set<std::string>& wanted = {});

/// A message's fields as filters see them, and "_meta": {"stamp_ns", "header_stamp_ns",
/// "sequence"}. Throws MessageError for bytes that do not fit the schema.
nlohmann::json messageDocument(const Schema& schema, const Message& message,
                               const WantedFields& wanted = {});

/// A condition over the messages of one type, of which it reads only the fields that it names.
/// Bytes that do not fit the type, and messages of a type that nobody understands, match the empty
/// condition alone.
class MessageMatcher {
 public:
  /// A null `schema` is a type that nobody understands. Keeps a reference to the condition.
  MessageMatcher(std::shared_ptr<const Schema> schema, const Condition& condition);
  bool matches(const Message& message) const;

 private:
  std::shared_ptr<const Schema> schema_;
  const Condition& condition_;
  WantedFields wanted_;
};

}  // namespace afterglow::replay
