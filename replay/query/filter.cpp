#include "replay/query/filter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "replay/messages/document.hpp"

namespace afterglow::replay {
namespace {

using nlohmann::json;
using Op = Condition::Op;

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

/// `on_topic` answers for the topics.
template <typename OnTopic>
bool evaluate(const Condition& condition, const json& document, const OnTopic& on_topic) {
  const auto part_holds = [&](const Condition& part) { return evaluate(part, document, on_topic); };
  const auto& parts = condition.parts;
  switch (condition.kind) {
    case Condition::Kind::All:
      return std::all_of(parts.begin(), parts.end(), part_holds);
    case Condition::Kind::Any:
      return std::any_of(parts.begin(), parts.end(), part_holds);
    case Condition::Kind::None:
      return std::none_of(parts.begin(), parts.end(), part_holds);
    case Condition::Kind::Value:
      return holdsAt(condition, document, 0);
    case Condition::Kind::Topic:
      break;
  }
  return on_topic(condition);
}

json parseObject(const std::string& text) { return json::parse(text, nullptr, false); }

}  // namespace

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

json messageDocument(const Schema& schema, const Message& message) {
  json document = toJson(decode(schema, message.bytes), {kLongestQueriedArray});
  json& meta = document["_meta"];
  meta = {{"stamp_ns", message.received.ns}, {"sequence", message.sequence}};
  if (message.header_stamp) meta["header_stamp_ns"] = message.header_stamp->ns;
  return document;
}

}  // namespace afterglow::replay
