#include "replay/ros2/ros2_topic.hpp"

#include <utility>

#include "replay/ros2/ros2_definition.hpp"

namespace afterglow::replay {
namespace {

constexpr std::size_t kLongestQuality = 1 << 16;

/// Whether a publisher gave late subscribers its last message, as a latched topic of ROS 1 does.
/// The policy is a number up to Humble and a word since.
bool isTransientLocal(const std::string& quality) {
  const std::string key = "durability:";
  if (quality.size() > kLongestQuality) return false;
  for (std::size_t at = quality.find(key); at != std::string::npos; at = quality.find(key, at)) {
    at = quality.find_first_not_of(" \"'", at + key.size());
    if (at == std::string::npos) break;
    const std::string word = quality.substr(at, quality.find_first_of(" \"',\r\n}", at) - at);
    if (word == "1" || word == "transient_local") return true;
  }
  return false;
}

}  // namespace

Ros2Topic::Ros2Topic(const Ros2Description& description, const FindDefinition& find, Source source)
    : source_(source) {
  if (description.serialization != "cdr") {
    throw MessageError("its messages are serialized as \"" +
                       description.serialization.substr(0, 40) + "\"; cdr is read");
  }
  // A node of ROS 1 knows absolute names alone.
  const bool is_absolute = description.topic.compare(0, 1, "/") == 0;
  channel_.topic = (is_absolute ? "" : "/") + description.topic;
  channel_.type = ros1TypeName(description.type);
  channel_.latching = isTransientLocal(description.quality);
  const auto known = find(channel_.type);
  if (description.definition_kind == "ros2msg") {
    try {
      readOwn(description, known);
    } catch (const MessageError& error) {
      readKnown(known, std::string("its definition is defective (") + error.what() + ")");
      why_mended_ = error.what();
    }
  } else {
    const std::string nobody = source_ == Source::Robot ? "no node of ROS 2 tells its type"
                                                        : "the bag has no definition of its type";
    readKnown(known, description.definition_kind.empty()
                         ? nobody
                         : "its type is defined as \"" + description.definition_kind.substr(0, 40) +
                               "\"; ros2msg is read");
  }
}

void Ros2Topic::readOwn(const Ros2Description& description,
                        const std::optional<Definition>& known) {
  Ros2Bounds bounds;
  const std::string own = ros1Definition(description.type, description.definition, &bounds);
  const Schema schema = Schema::parse(channel_.type, own);
  const bool has_fields = !schema.root().fields.empty();
  if (!has_fields && known && !Schema::parse(channel_.type, known->text).root().fields.empty()) {
    throw MessageError("it has no field");
  }
  rest_ = CdrConversion::Rest::Ignored;
  if (!known && source_ == Source::Robot) {
    layouts_.emplace_back(schema, schema, bounds);
    channel_.md5 = definitionMd5(channel_.type, own);
    channel_.definition = own;
    return;
  }
  try {
    if (!known) throw MessageError("no ROS 1 type " + channel_.type + " is known here");
    layouts_.emplace_back(schema, Schema::parse(channel_.type, known->text), bounds);
    channel_.md5 = known->md5;
    channel_.definition = known->text;
  } catch (const MessageError& reason) {
    why_foreign_ = reason.what();
    channel_.md5 = definitionMd5(channel_.type, own);
    channel_.definition = markAsForeign(own, why_foreign_);
    layouts_.emplace_back(schema, schema);
  }
}

void Ros2Topic::readKnown(const std::optional<Definition>& known,
                          const std::string& why_not_own) {
  if (!known) throw MessageError(why_not_own + ", and ROS 1 knows none here");
  for (const std::string& text : ros2Layouts(channel_.type, *known)) {
    layouts_.emplace_back(Schema::parse(channel_.type, text),
                          Schema::parse(channel_.type, known->text));
  }
  if (layouts_.empty() && source_ == Source::Robot) {
    const Schema schema = Schema::parse(channel_.type, known->text);
    layouts_.emplace_back(schema, schema);
  }
  if (layouts_.empty()) {
    throw MessageError(why_not_own + ", and it is not known to have ROS 1's fields");
  }
  channel_.md5 = known->md5;
  channel_.definition = known->text;
}

Bytes Ros2Topic::toRos1(const Bytes& bytes) {
  if (layouts_.size() == 1) return layouts_.front().toRos1(bytes, rest_);
  std::vector<CdrConversion> fitting;
  Bytes ros1;
  std::string problem;
  for (const CdrConversion& layout : layouts_) {
    try {
      Bytes read = layout.toRos1(bytes);
      if (fitting.empty()) ros1 = std::move(read);
      fitting.push_back(layout);
    } catch (const MessageError& error) {
      problem = error.what();
    }
  }
  if (fitting.empty()) throw MessageError(problem);
  // A list that is empty fits all of them.
  if (fitting.size() == 1) layouts_ = std::move(fitting);
  return ros1;
}

}  // namespace afterglow::replay
