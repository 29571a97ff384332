#include "replay/store/mongo/roslog_document.hpp"

#include <algorithm>

#include "replay/store/mongo/mongo_bson.hpp"

namespace afterglow::replay {
namespace {

/// Moves to "_meta.topic"; false if there is none.
bool locate(const bson_t& document, const char* path, bson_iter_t& at) {
  bson_iter_t root;
  return bson_iter_init(&root, &document) && bson_iter_find_descendant(&root, path, &at);
}

std::string textOf(const bson_t& document, const char* path) {
  return textAt(document, path).value_or("");
}

/// A date that can be a ROS time.
std::optional<Stamp> dateOf(const bson_t& document, const char* path) {
  constexpr std::int64_t kEnd_ms = std::int64_t{1000} << 32;
  bson_iter_t at;
  if (!locate(document, path, at) || !BSON_ITER_HOLDS_DATE_TIME(&at)) return std::nullopt;
  const std::int64_t ms = bson_iter_date_time(&at);
  if (ms < 0 || ms >= kEnd_ms) return std::nullopt;
  return Stamp{ms * 1'000'000};
}

bool has(const bson_t& document, const char* path) {
  bson_iter_t at;
  return locate(document, path, at);
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
  if (has(document, "_meta.received_ns")) return RoslogFacts::Writer::Afterglow;
  if (has(document, "_meta.inserted_by")) return RoslogFacts::Writer::MessageStore;
  return topic.empty() ? RoslogFacts::Writer::CppLogger : RoslogFacts::Writer::Logger;
}

std::optional<RoslogFacts> tfFacts(const bson_t& document) {
  const auto recorded = dateOf(document, "__recorded");
  if (!recorded || !has(document, "transforms")) return std::nullopt;
  // tf/tfMessage is gone; this one has the same fields and MD5.
  return RoslogFacts{RoslogFacts::Writer::TfLogger, *recorded,
                     absolute(textOf(document, "__topic")), "tf2_msgs/TFMessage", false};
}

}  // namespace

std::optional<RoslogFacts> roslogFacts(const bson_t& document) {
  if (!has(document, "_meta")) return tfFacts(document);
  RoslogFacts facts;
  facts.topic = absolute(textOf(document, "_meta.topic"));
  facts.writer = writerOf(document, facts.topic);
  facts.type = textOf(document, "_meta.stored_type");
  if (facts.type.empty()) facts.type = typeOfClass(textOf(document, "_meta.stored_class"));
  if (facts.type == "tf/tfMessage") facts.type = "tf2_msgs/TFMessage";
  const auto inserted = dateOf(document, "_meta.inserted_at");
  if (facts.type.empty() || !inserted) return std::nullopt;
  facts.inserted = *inserted;
  bson_iter_t latch;
  facts.latching = locate(document, "_meta.latch", latch) && bson_iter_as_bool(&latch);
  return facts;
}

std::string roslogCollection(const std::string& topic) {
  std::string name = topic;
  std::replace(name.begin(), name.end(), '/', '_');
  return name.empty() ? name : name.substr(1);
}

}  // namespace afterglow::replay
