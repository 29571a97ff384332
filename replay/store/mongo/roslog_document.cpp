#include "replay/store/mongo/roslog_document.hpp"

#include "replay/store/mongo/mongo_bson.hpp"

namespace afterglow::replay {
namespace {

std::string textOf(const bson_t& document, const char* path) {
  return textAt(document, path).value_or("");
}

/// A date that can be a ROS time.
std::optional<Stamp> dateOf(const bson_t& document, const char* path) {
  constexpr std::int64_t kEnd_ms = std::int64_t{1000} << 32;
  const auto ms = dateAt(document, path);
  if (!ms || *ms < 0 || *ms >= kEnd_ms) return std::nullopt;
  return Stamp{*ms * 1'000'000};
}

/// "geometry_msgs.msg._Twist.Twist" -> "geometry_msgs/Twist"
std::string typeOfClass(const std::string& python_class) {
  const std::size_t first = python_class.find('.');
  if (first == std::string::npos) return "";
  return python_class.substr(0, first) + "/" + python_class.substr(python_class.rfind('.') + 1);
}

std::string absolute(const std::string& topic) {
  return topic.empty() || topic.front() == '/' ? topic : "/" + topic;
}

RoslogFacts::Writer writerOf(const bson_t& document, const std::string& topic) {
  if (hasAt(document, "_meta.received_ns")) return RoslogFacts::Writer::Afterglow;
  if (hasAt(document, "_meta.inserted_by")) return RoslogFacts::Writer::MessageStore;
  return topic.empty() ? RoslogFacts::Writer::CppLogger : RoslogFacts::Writer::Logger;
}

std::optional<RoslogFacts> tfFacts(const bson_t& document) {
  const auto recorded = dateOf(document, "__recorded");
  if (!recorded || !hasAt(document, "transforms")) return std::nullopt;
  // tf/tfMessage is gone; this one has the same fields and MD5.
  return RoslogFacts{RoslogFacts::Writer::TfLogger, *recorded,
                     absolute(textOf(document, "__topic")), "tf2_msgs/TFMessage", false, true};
}

}  // namespace

std::optional<RoslogFacts> roslogFacts(const bson_t& document) {
  if (!hasAt(document, "_meta")) return tfFacts(document);
  RoslogFacts facts;
  facts.topic = absolute(textOf(document, "_meta.topic"));
  facts.writer = writerOf(document, facts.topic);
  facts.type = textOf(document, "_meta.stored_type");
  if (facts.type.empty()) facts.type = typeOfClass(textOf(document, "_meta.stored_class"));
  facts.was_tf_message = facts.type == "tf/tfMessage";
  if (facts.was_tf_message) facts.type = "tf2_msgs/TFMessage";
  const auto inserted = dateOf(document, "_meta.inserted_at");
  if (facts.type.empty() || !inserted) return std::nullopt;
  facts.inserted = *inserted;
  facts.latching = isTrueAt(document, "_meta.latch");
  return facts;
}

}  // namespace afterglow::replay
