#include "replay/ros2/message_to_ros2.hpp"

#include "replay/ros2/ros2_definition.hpp"
#include "replay/ros2/twist_stamp.hpp"

namespace afterglow::replay {
namespace {

Ros2Topic topicOf(const MessageToRos2::Wanted& wanted, const std::string& ros1_type,
                  const Definition& definition) {
  const bool is_same = ros1_type == ros1TypeName(wanted.type);
  const FindDefinition find = [&](const std::string& type) {
    return is_same ? std::optional(definition) : findInstalled()(type);
  };
  const Ros2Description description{
      wanted.topic,      wanted.type, "cdr", wanted.definition.empty() ? "" : "ros2msg",
      wanted.definition, ""};
  Ros2Topic topic(description, find, Ros2Topic::Source::Robot);
  if (!topic.whyForeign().empty()) throw MessageError(topic.whyForeign());
  return topic;
}

}  // namespace

MessageToRos2::MessageToRos2(const Wanted& wanted, const std::string& ros1_type,
                             const Definition& definition)
    : ros1_type_(ros1_type), topic_(topicOf(wanted, ros1_type, definition)) {}

bool MessageToRos2::isPossible(const std::string& ros1_type, const std::string& ros2_type) {
  const std::string wanted = ros1TypeName(ros2_type);
  return ros1_type == wanted || otherTwist(ros1_type) == wanted;
}

Bytes MessageToRos2::convert(const Bytes& bytes, Stamp now) const {
  const bool is_same = ros1_type_ == topic_.channel().type;
  return topic_.toRos2(is_same ? bytes : toOtherTwist(ros1_type_, bytes, now));
}

}  // namespace afterglow::replay
