#include "replay/query/filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <sstream>

#include "replay/messages/document.hpp"
#include "replay/messages/foreign_json.hpp"
#include "replay/query/nearest.hpp"
#include "replay/query/time_text.hpp"

namespace afterglow::replay {
namespace {

RegularExpression compiled(const std::string& pattern, const std::string& options) {
  const auto unknown = options.find_first_not_of("imsx");
  if (unknown != std::string::npos) {
    throw FilterError(std::string("$options knows i, m, s and x, not \"") + options[unknown] +
                      "\"");
  }
  try {
    return RegularExpression(pattern, options);
  } catch (const std::invalid_argument& error) {
    throw FilterError("$regex \"" + pattern + "\", " + error.what());
  }
}

}  // namespace

TextPattern::TextPattern(const std::string& pattern, const std::string& options)
    : pattern_(pattern), expression_(compiled(pattern, options)) {}

bool TextPattern::isIn(const std::string& text) const {
  try {
    return expression_.isIn(text);
  } catch (const RegularExpression::TooLong&) {
    throw FilterError("$regex \"" + pattern_ + "\" takes too long; are repetitions nested in it?");
  }
}

namespace {

using nlohmann::json;
using Kind = Condition::Kind;
using Op = Condition::Op;

// ----------------------------------------------------------------------------------------- judging

/// 64 bits of mantissa and more: it holds every integer of 64 bits and every double exactly.
using Number = long double;
static_assert(std::numeric_limits<Number>::digits >= 64);

std::optional<Number> numberOf(const json& value) {
  if (value.is_number_unsigned()) return static_cast<Number>(value.get<std::uint64_t>());
  if (value.is_number_integer()) return static_cast<Number>(value.get<std::int64_t>());
  if (value.is_number_float()) return static_cast<Number>(value.get<double>());
  if (!value.is_string()) return std::nullopt;
  const auto& text = value.get_ref<const std::string&>();
  if (text == "nan") return std::numeric_limits<Number>::quiet_NaN();
  if (text == "inf") return std::numeric_limits<Number>::infinity();
  if (text == "-inf") return -std::numeric_limits<Number>::infinity();
  return std::nullopt;
}

/// `value` is null where the path leads nowhere.
bool isEqual(const json* value, const json& operand) {
  if (operand.is_null()) return !value || value->is_null();
  if (!value) return false;
  if (*value == operand) return true;
  const auto a = numberOf(*value), b = numberOf(operand);
  return a && b && (*a == *b || (std::isnan(*a) && std::isnan(*b)));
}

template <typename T>
bool isOrdered(const T& a, Op op, const T& b) {
  switch (op) {
    case Op::Less:
      return a < b;
    case Op::LessEqual:
      return a <= b;
    case Op::Greater:
      return a > b;
    default:
      return a >= b;
  }
}

bool isOrdered(const json* value, Op op, const json& operand) {
  const bool with_equal = op == Op::LessEqual || op == Op::GreaterEqual;
  if (with_equal && isEqual(value, operand)) return true;
  if (!value) return false;
  if (value->is_string() && operand.is_string() &&
      isOrdered(value->get_ref<const std::string&>(), op, operand.get_ref<const std::string&>())) {
    return true;
  }
  if (value->is_boolean() && operand.is_boolean()) {
    return isOrdered(value->get<bool>(), op, operand.get<bool>());
  }
  const auto a = numberOf(*value), b = numberOf(operand);
  return a && b && isOrdered(*a, op, *b);
}

bool holdsForOne(const Condition& condition, const json* value) {
  switch (condition.op) {
    case Op::Equal:
      return isEqual(value, condition.operand);
    case Op::In:
      return std::any_of(condition.operand.begin(), condition.operand.end(),
                         [&](const json& operand) { return isEqual(value, operand); });
    case Op::Matches:
      return value && value->is_string() &&
             condition.pattern->isIn(value->get_ref<const std::string&>());
    default:
      return isOrdered(value, condition.op, condition.operand);
  }
}

bool holds(const Condition& condition, const json* value) {
  if (condition.op == Op::Exists) return value != nullptr;
  const bool is_array = value && value->is_array();
  if (condition.op == Op::Element) {
    return is_array && std::any_of(value->begin(), value->end(), [&](const json& element) {
             return condition.parts.front().matches(element);
           });
  }
  return holdsForOne(condition, value) ||
         (is_array && std::any_of(value->begin(), value->end(), [&](const json& element) {
            return holdsForOne(condition, &element);
          }));
}

std::optional<std::size_t> indexOf(const std::string& name) {
  if (name.empty() || name.size() > 9) return std::nullopt;
  std::size_t index = 0;
  for (const char c : name) {
    if (c < '0' || c > '9') return std::nullopt;
    index = index * 10 + static_cast<std::size_t>(c - '0');
  }
  return index;
}

/// True if the condition holds for one of the values that its path, from `at` on, leads to.
bool holdsAt(const Condition& condition, const json& value, std::size_t at) {
  const std::string& path = condition.path;
  if (at > path.size() || path.empty()) return holds(condition, &value);
  const std::size_t dot = std::min(path.find('.', at), path.size());
  const std::string name = path.substr(at, dot - at);
  if (value.is_object()) {
    const auto field = value.find(name);
    return field == value.end() ? holds(condition, nullptr) : holdsAt(condition, *field, dot + 1);
  }
  if (!value.is_array()) return holds(condition, nullptr);
  const auto index = indexOf(name);
  if (index && *index < value.size() && holdsAt(condition, value[*index], dot + 1)) return true;
  return std::any_of(value.begin(), value.end(), [&](const json& element) {
    // What is not there at an index is no null in the objects of the array.
    return element.is_object() && (!index || element.contains(name)) &&
           holdsAt(condition, element, at);
  });
}

/// Evaluates a condition; `on_topic` answers for the topics.
template <typename OnTopic>
bool evaluate(const Condition& condition, const json& document, const OnTopic& on_topic) {
  const auto part_holds = [&](const Condition& part) { return evaluate(part, document, on_topic); };
  const auto& parts = condition.parts;
  switch (condition.kind) {
    case Kind::All:
      return std::all_of(parts.begin(), parts.end(), part_holds);
    case Kind::Any:
      return std::any_of(parts.begin(), parts.end(), part_holds);
    case Kind::None:
      return std::none_of(parts.begin(), parts.end(), part_holds);
    case Kind::Value:
      return holdsAt(condition, document, 0);
    case Kind::Topic:
      break;
  }
  return on_topic(condition);
}

/// The fields of a message that a condition names, without the indices of elements.
void addFields(const Condition& condition, WantedFields& wanted) {
  if (condition.kind == Kind::Value) {
    std::vector<std::string> fields;
    std::istringstream path(condition.path);
    for (std::string name; std::getline(path, name, '.');) {
      if (!indexOf(name)) fields.push_back(name);
    }
    wanted.add(fields);
    return;
  }
  for (const Condition& part : condition.parts) addFields(part, wanted);
}

json parseObject(const std::string& text) { return parseForeignJson(text); }

// ----------------------------------------------------------------------------------------- parsing

/// The depth of MongoDB's filters; it keeps a hostile filter from taking the stack.
constexpr int kDeepest = 100;

const std::map<std::string, Kind> kGroups = {
    {"$and", Kind::All}, {"$or", Kind::Any}, {"$nor", Kind::None}};

const std::map<std::string, Op> kOrders = {
    {"$gt", Op::Greater}, {"$gte", Op::GreaterEqual}, {"$lt", Op::Less}, {"$lte", Op::LessEqual}};

const std::vector<std::string> kFilterOperators = {"$and", "$or", "$nor", "$not"};

const std::vector<std::string> kFieldOperators = {
    "$eq",  "$ne",     "$gt",    "$gte",     "$lt",  "$lte",      "$in",
    "$nin", "$exists", "$regex", "$options", "$not", "$elemMatch"};

const std::vector<std::string> kBehaviorFields = {
    "id",          "key",           "recording",  "name",     "tree_path",  "parent",
    "attempt",     "outcome",       "begin",      "begin_ns", "end",        "end_ns",
    "wall_begin",  "wall_begin_ns", "duration_s", "robot",    "parameters", "tags",
    "calibration", "topics",        "snapshot",   "remarks"};

const std::set<std::string> kTimes = {"begin",  "begin_ns",   "end",
                                      "end_ns", "wall_begin", "wall_begin_ns"};

std::string quoted(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string firstName(const std::string& path) { return path.substr(0, path.find('.')); }

bool isOperator(const std::string& key) { return !key.empty() && key[0] == '$'; }

bool hasOperator(const json& value) {
  if (!value.is_object()) return false;
  for (const auto& item : value.items()) {
    if (isOperator(item.key())) return true;
  }
  return false;
}

Condition group(Kind kind, std::vector<Condition> parts) {
  Condition condition;
  condition.kind = kind;
  condition.parts = std::move(parts);
  return condition;
}

Condition negation(Condition part) { return group(Kind::None, {std::move(part)}); }

class Parser {
 public:
  Parser(Filter::Over over, std::set<std::string>& fields) : over_(over), fields_(fields) {}

  Condition filter(const json& object) {
    if (!object.is_object())
      fail("a filter is an object such as {\"name\": \"pick\"}, not " + quoted(object));
    const Depth depth(*this);
    std::vector<Condition> parts;
    for (const auto& [key, value] : object.items()) {
      const Place place(*this, key);
      parts.push_back(isOperator(key) ? filterOperator(key, value)
                      : isTopic(key)  ? topic(key, value)
                                      : field(key, value));
    }
    return together(std::move(parts));
  }

 private:
  /// The place in the filter where errors are.
  class Place {
   public:
    Place(Parser& parser, const std::string& key) : parser_(parser) {
      parser_.places_.push_back(key);
    }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    ~Place() { parser_.places_.pop_back(); }

   private:
    Parser& parser_;
  };
  class Depth {
   public:
    explicit Depth(Parser& parser) : parser_(parser) {
      if (++parser_.depth_ > kDeepest) {
        throw FilterError("the filter nests deeper than " + std::to_string(kDeepest));
      }
    }
    Depth(const Depth&) = delete;
    Depth& operator=(const Depth&) = delete;
    ~Depth() { --parser_.depth_; }

   private:
    Parser& parser_;
  };

  [[noreturn]] void fail(const std::string& what) const {
    const std::string where = fmt::format("{}", fmt::join(places_, " > "));
    throw FilterError("filter" + (where.empty() ? "" : ", at " + where) + ": " + what);
  }

  /// All of them; the cheap ones, which need no message, first.
  static Condition together(std::vector<Condition> parts) {
    if (parts.size() == 1) return std::move(parts.front());
    std::stable_partition(parts.begin(), parts.end(),
                          [](const Condition& part) { return !part.asksTopics(); });
    return group(Kind::All, std::move(parts));
  }

  bool isTopic(const std::string& key) const {
    return over_ == Filter::Over::Behaviors && !in_topic_ && key.rfind('/', 0) == 0;
  }

  Condition filterOperator(const std::string& name, const json& value) {
    if (name == "$not") return negation(filter(value));
    const auto known = kGroups.find(name);
    if (known == kGroups.end()) {
      fail("there is no operator " + name + " around filters" + didYouMean(name, kFilterOperators));
    }
    if (!value.is_array() || value.empty()) fail("expected an array of filters");
    std::vector<Condition> parts;
    for (const json& element : value) parts.push_back(filter(element));
    std::stable_partition(parts.begin(), parts.end(),
                          [](const Condition& part) { return !part.asksTopics(); });
    return group(known->second, std::move(parts));
  }

  Condition topic(const std::string& name, json value) {
    if (!value.is_object()) {
      fail("a topic takes a filter over its messages, such as {\"data\": \"done\"}, not " +
           quoted(value));
    }
    const json exists = value.value("$exists", json(true));
    value.erase("$exists");
    const bool is_there = truth(exists);
    if (!is_there && !value.empty()) fail("{\"$exists\": false} stands alone");
    in_topic_ = true;
    Condition condition = group(Kind::Topic, {filter(value)});
    in_topic_ = false;
    condition.path = name;
    condition.operand = std::move(value);
    return is_there ? condition : negation(std::move(condition));
  }

  Condition field(const std::string& path, const json& value) {
    if (path.empty()) fail("a field has a name");
    if (isOfBehavior()) {
      const std::string name = firstName(path);
      const auto& known = kBehaviorFields;
      if (std::find(known.begin(), known.end(), name) == known.end()) {
        fail("behaviors have no field " + name + didYouMean(name, known));
      }
      fields_.insert(name);
    }
    return tests(path, value);
  }

  bool isOfBehavior() const {
    return over_ == Filter::Over::Behaviors && !in_topic_ && !in_element_;
  }

  /// Reads the tests of the values at a path: one value, or operators.
  Condition tests(const std::string& path, const json& value) {
    const Depth depth(*this);
    if (!hasOperator(value)) return test(path, Op::Equal, value);
    std::vector<Condition> parts;
    for (const auto& [key, operand] : value.items()) {
      const Place place(*this, key);
      if (!isOperator(key)) fail("a field among operators");
      if (key == "$options") {
        if (!value.contains("$regex")) fail("without $regex");
        continue;
      }
      parts.push_back(key == "$regex" ? regex(path, operand, value.value("$options", json("")))
                                      : fieldOperator(path, key, operand));
    }
    return together(std::move(parts));
  }

  Condition fieldOperator(const std::string& path, const std::string& name, const json& operand) {
    if (name == "$eq") return test(path, Op::Equal, operand);
    if (name == "$ne") return negation(test(path, Op::Equal, operand));
    if (const auto order = kOrders.find(name); order != kOrders.end()) {
      if (operand.is_structured()) fail("compares with a number, a string, true or false");
      return test(path, order->second, operand);
    }
    if (name == "$in" || name == "$nin") {
      if (!operand.is_array()) fail("expected an array of values");
      Condition in = test(path, Op::In, operand);
      return name == "$in" ? in : negation(std::move(in));
    }
    if (name == "$exists") {
      Condition exists = test(path, Op::Exists, nullptr);
      return truth(operand) ? exists : negation(std::move(exists));
    }
    if (name == "$not") {
      if (!hasOperator(operand)) fail("expected an object of operators such as {\"$gt\": 3}");
      return negation(tests(path, operand));
    }
    if (name == "$elemMatch") return element(path, operand);
    fail("there is no operator " + name + didYouMean(name, kFieldOperators));
  }

  Condition test(const std::string& path, Op op, json operand) {
    Condition condition;
    condition.kind = Kind::Value;
    condition.path = path;
    condition.op = op;
    if (op != Op::Exists) checkOperand(operand);
    if (isOfBehavior() && kTimes.count(path) > 0) readTimes(operand);
    condition.operand = std::move(operand);
    return condition;
  }

  void checkOperand(const json& operand) const {
    if (hasOperator(operand)) fail("an operator, where a value is expected");
    if (!operand.is_array()) return;
    for (const json& element : operand) {
      if (hasOperator(element)) fail("an operator, where a value is expected");
    }
  }

  void readTimes(json& operand) const {
    if (operand.is_array()) {
      for (json& element : operand) readTimes(element);
    } else if (operand.is_string()) {
      const auto stamp = parseTime(operand.get<std::string>());
      if (!stamp) fail(quoted(operand) + " is no time; " + kTimesUnderstood);
      operand = stamp->ns;
    }
  }

  Condition regex(const std::string& path, const json& pattern, const json& options) {
    if (!pattern.is_string() || !options.is_string()) fail("pattern and $options are strings");
    Condition condition = test(path, Op::Matches, pattern);
    try {
      condition.pattern = std::make_shared<const TextPattern>(pattern.get<std::string>(),
                                                              options.get<std::string>());
    } catch (const FilterError& error) {
      fail(error.what());
    }
    return condition;
  }

  Condition element(const std::string& path, const json& value) {
    if (!value.is_object()) fail("expected an object of operators or of fields");
    const bool was_in_element = std::exchange(in_element_, true);
    const bool is_of_values = hasOperator(value) && kGroups.count(value.begin().key()) == 0;
    Condition condition;
    condition.kind = Kind::Value;
    condition.path = path;
    condition.op = Op::Element;
    condition.parts = {is_of_values ? tests("", value) : filter(value)};
    in_element_ = was_in_element;
    return condition;
  }

  bool truth(const json& value) const {
    if (value.is_boolean()) return value.get<bool>();
    if (value.is_number()) return value.get<double>() != 0;
    fail("expected true or false, not " + quoted(value));
  }

  const Filter::Over over_;
  std::set<std::string>& fields_;
  std::vector<std::string> places_;
  int depth_ = 0;
  bool in_topic_ = false, in_element_ = false;
};

json parseJson(const std::string& text) {
  if (!isShallowJson(text)) {
    throw FilterError("the filter nests deeper than " + std::to_string(kDeepestJson));
  }
  try {
    return json::parse(text);
  } catch (const json::exception& error) {  // a number too large for a double is no parse_error
    std::string what = error.what();
    if (const auto bracket = what.find("] "); bracket != std::string::npos) {
      what.erase(0, bracket + 2);
    }
    throw FilterError("filter: no JSON: " + what);
  }
}

}  // namespace

Filter Filter::parse(const std::string& text, Over over) {
  Filter filter;
  filter.text_ = text;
  filter.root_ = Parser(over, filter.fields_).filter(parseJson(text));
  return filter;
}

bool Condition::asksTopics() const {
  return kind == Kind::Topic || std::any_of(parts.begin(), parts.end(), [](const Condition& part) {
           return part.asksTopics();
         });
}

bool Condition::matches(const json& document) const {
  return evaluate(*this, document, [](const Condition& topic) -> bool {
    throw std::logic_error("a filter over messages asks for the topic " + topic.path);
  });
}

bool Filter::matches(const Behavior& behavior, const AnyMessage& any_message) const {
  const json document = fields_.empty() ? json::object() : behaviorDocument(behavior, fields_);
  return evaluate(root_, document, [&](const Condition& topic) {
    return any_message(topic.path, topic.parts.front());
  });
}

json behaviorDocument(const Behavior& behavior, const std::set<std::string>& wanted) {
  json document = json::object();
  const auto add = [&](const char* name, const auto& value) {
    if (wanted.empty() || wanted.count(name) > 0) document[name] = value();
  };
  const auto addTime = [&](const std::string& name, Stamp stamp) {
    for (const std::string& key : {name, name + "_ns"}) add(key.c_str(), [&] { return stamp.ns; });
  };
  add("id", [&] { return behavior.id; });
  add("key", [&] { return behavior.key; });
  add("recording", [&] { return behavior.recording; });
  add("name", [&] { return behavior.name; });
  add("tree_path", [&] { return behavior.tree_path; });
  add("parent", [&] { return behavior.parent; });
  add("attempt", [&] { return behavior.attempt; });
  add("outcome", [&] { return behavior.outcome; });
  addTime("begin", behavior.begin);
  addTime("wall_begin", behavior.wall_begin);
  if (behavior.end) {
    addTime("end", *behavior.end);
    add("duration_s",
        [&] { return static_cast<double>(behavior.end->ns - behavior.begin.ns) * 1e-9; });
  }
  add("robot", [&] { return behavior.robot; });
  add("parameters", [&] { return parseObject(behavior.parameters); });
  add("tags", [&] { return behavior.tags; });
  add("calibration", [&] { return parseObject(behavior.calibration); });
  add("topics", [&] { return behavior.topics; });
  add("snapshot", [&] { return parseObject(behavior.snapshot); });
  add("remarks", [&] { return behavior.remarks; });
  return document;
}

json messageDocument(const Schema& schema, const Message& message, const WantedFields& wanted) {
  json document = toJson(decode(schema, message.bytes, wanted), {kLongestQueriedArray});
  if (!wanted.find("_meta")) return document;
  json& meta = document["_meta"];
  meta = {{"stamp_ns", message.received.ns}, {"sequence", message.sequence}};
  if (message.header_stamp) meta["header_stamp_ns"] = message.header_stamp->ns;
  return document;
}

MessageMatcher::MessageMatcher(std::shared_ptr<const Schema> schema, const Condition& condition)
    : schema_(std::move(schema)), condition_(condition) {
  addFields(condition, wanted_);
}

bool MessageMatcher::matches(const Message& message) const {
  if (condition_.isEmpty()) return true;
  if (!schema_) return false;
  try {
    return condition_.matches(messageDocument(*schema_, message, wanted_));
  } catch (const MessageError&) {
    return false;
  }
}

}  // namespace afterglow::replay
