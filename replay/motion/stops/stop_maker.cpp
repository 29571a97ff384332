#include "replay/motion/stops/stop_maker.hpp"

#include <algorithm>
#include <string_view>

#include "replay/messages/document.hpp"
#include "replay/messages/wire.hpp"
#include "replay/motion/goal_book.hpp"
#include "replay/motion/goal_remainder.hpp"

namespace afterglow::replay {
namespace {

/// True if the number there was another one; -0 is 0, too.
bool setField(const FieldSpan& span, double value, Bytes& bytes) {
  const FieldType type = span.type == FieldType::Bool ? FieldType::UInt8 : span.type;
  return withNumber(type, [&](auto number) {
    std::uint8_t* at = bytes.data() + span.offset;
    const auto wanted = static_cast<decltype(number)>(value);
    if (loadNumber<decltype(number)>(at) == wanted) return false;
    storeNumber(at, wanted);
    return true;
  });
}

Channel stopChannel(const Channel& output, const MotionStop& stop) {
  if (stop.kind != StopKind::Cancel) return output;
  Channel cancel = cancelChannel(output);
  if (!stop.cancel_topic.empty()) cancel.topic = stop.cancel_topic;
  return cancel;
}

}  // namespace

StopMaker::StopMaker(const Channel& output, const MotionStop& stop)
    : stop_(stop), channel_(stopChannel(output, stop)) {
  if (!stop_.isSetPoint() && stop_.kind != StopKind::NoPoints) return;
  schema_ = Schema::of(output);
  std::vector<FieldPath> paths;
  for (const auto& [path, value] : stoppingFields(stop_, *schema_)) {
    paths.push_back(FieldPath::parse(path));
    values_.push_back(value);
  }
  if (!paths.empty()) finder_.emplace(*schema_, paths);
}

bool StopMaker::hasMessage() const {
  return isSetPoint() || stop_.kind == StopKind::NoPoints || stop_.kind == StopKind::Cancel;
}

/// True if one was another.
bool StopMaker::setFields(Bytes& message) const {
  bool has_changed = false;
  if (!finder_) return has_changed;
  const auto places = finder_->find(message);
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (const FieldSpan& span : places[i]) {
      has_changed = setField(span, values_[i], message) || has_changed;
    }
  }
  return has_changed;
}

Bytes StopMaker::after(const Bytes& last) const {
  if (stop_.kind == StopKind::Cancel) return cancelMessage("");
  if (stop_.kind == StopKind::NoPoints) return haltedTrajectory(channel_, last);
  Bytes message = isSetPoint() ? last : Bytes();
  if (!isSetPoint()) return message;
  setFields(message);
  // Whenever it is sent: a stop that stays the same need not be told to the watchdogs again.
  constexpr std::ptrdiff_t kSequenceAndStamp = 12;
  if (headerStamp(*schema_, message)) {
    std::fill(message.begin(), message.begin() + kSequenceAndStamp, std::uint8_t{0});
  }
  return message;
}

Bytes StopMaker::before() const {
  return schema_ ? after(Bytes(schema_->minimumSize(0))) : after({});
}

bool StopMaker::isNeutral(const Bytes& message) const {
  try {
    Bytes stopping = message;
    return isSetPoint()                        ? !setFields(stopping)
           : stop_.kind == StopKind::NoPoints ? haltedTrajectory(channel_, message) == message
                                              : stop_.kind == StopKind::IsStop;
  } catch (const MessageError&) {
    return false;
  }
}

std::optional<Channel> haltChannel(const Channel& goal) {
  for (const std::string_view action :
       {"/follow_joint_trajectory/goal", "/joint_trajectory_action/goal"}) {
    const std::string& topic = goal.topic;
    if (!endsWith(topic, action)) continue;
    Channel channel;
    channel.topic = topic.substr(0, topic.size() - action.size()) + "/command";
    channel.type = "trajectory_msgs/JointTrajectory";
    channel.md5 = "65b4f94a94d1ed67169da35a02f33d3f";
    channel.definition =
        "std_msgs/Header header\nstring[] joint_names\nJointTrajectoryPoint[] points\n"
        "================================================================================\n"
        "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
        "================================================================================\n"
        "MSG: trajectory_msgs/JointTrajectoryPoint\nfloat64[] positions\nfloat64[] velocities\n"
        "float64[] accelerations\nfloat64[] effort\nduration time_from_start\n";
    return channel;
  }
  return std::nullopt;
}

Bytes gapGoal(const Channel& channel, const Bytes& last, double gap) {
  const Schema schema = Schema::of(channel);
  Value document = decode(schema, last);
  for (const char* stamp : {"header.stamp", "goal_id.stamp"}) valueAt(document, stamp) = RosTime{};
  Value& id = valueAt(document, "goal_id.id");
  if (const auto* text = std::get_if<std::string>(&id)) id = *text + "-hold";
  valueAt(document, "goal.command.position") = gap;
  return encode(schema, document);
}

Bytes haltMessage() { return Bytes(24); }  // a header, and the counts of joints and points

}  // namespace afterglow::replay
