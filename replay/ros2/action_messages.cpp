#include "replay/ros2/action_messages.hpp"

#include <algorithm>
#include <cstddef>

#include "replay/messages/schema.hpp"
#include "replay/messages/wire.hpp"
#include "replay/ros2/cdr_conversion.hpp"

namespace afterglow::replay {
namespace {

constexpr std::string_view kHexDigits = "0123456789abcdef";

/// Writes a message of ROS 1.
class MessageBytes {
 public:
  template <typename T>
  MessageBytes& number(T value) {
    std::uint8_t bytes[sizeof(T)];
    storeNumber(bytes, value);
    bytes_.insert(bytes_.end(), bytes, bytes + sizeof(T));
    return *this;
  }
  MessageBytes& stamp(Stamp stamp) {
    constexpr std::int64_t kSecond = 1'000'000'000;
    return number(static_cast<std::uint32_t>(stamp.ns / kSecond))
        .number(static_cast<std::uint32_t>(stamp.ns % kSecond));
  }
  MessageBytes& text(const std::string& text) {
    number(static_cast<std::uint32_t>(text.size()));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    return *this;
  }
  MessageBytes& header(Stamp now) { return number(std::uint32_t{0}).stamp(now).text(""); }
  MessageBytes& goalId(const ActionGoalId& id) { return stamp(id.stamp).text(id.id); }
  MessageBytes& status(const ActionGoalStatus& status) {
    return goalId(status.goal).number(static_cast<std::uint8_t>(status.state)).text(status.text);
  }
  MessageBytes& bytes(const Bytes& bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  Bytes take() { return std::move(bytes_); }

 private:
  Bytes bytes_;
};

Stamp readStamp(WireReader& reader) {
  const auto seconds = reader.number<std::uint32_t>();
  return Stamp::fromParts(seconds, reader.number<std::uint32_t>());
}

ActionGoalId readGoalId(WireReader& reader) {
  const Stamp stamp = readStamp(reader);
  return {stamp, reader.string()};
}

/// A message of ROS 2 whose fields have the same names and types in ROS 1's terms.
CdrConversion plainConversion(const std::string& type, const std::string& definition) {
  const Schema schema = Schema::parse(type, definition);
  return {schema, schema};
}

const std::string kGoalInfo = "===\nMSG: action_msgs/GoalInfo\nuint8[16] goal_id\ntime stamp\n";

const CdrConversion& goalReply() {
  static const auto kConversion =
      plainConversion("action_msgs/SendGoal_Response", "uint8 accepted\ntime stamp\n");
  return kConversion;
}
const CdrConversion& resultRequestConversion() {
  static const auto kConversion =
      plainConversion("action_msgs/GetResult_Request", "uint8[16] goal_id\n");
  return kConversion;
}
const CdrConversion& cancelRequestConversion() {
  static const auto kConversion =
      plainConversion("action_msgs/CancelGoal_Request", "GoalInfo goal_info\n" + kGoalInfo);
  return kConversion;
}
const CdrConversion& cancelReply() {
  static const auto kConversion = plainConversion(
      "action_msgs/CancelGoal_Response", "int8 return_code\nGoalInfo[] goals\n" + kGoalInfo);
  return kConversion;
}
const CdrConversion& statusList() {
  static const auto kConversion = plainConversion(
      "action_msgs/GoalStatusArray",
      "GoalStatus[] status_list\n===\nMSG: action_msgs/GoalStatus\nGoalInfo goal_info\n"
      "int8 status\n" +
          kGoalInfo);
  return kConversion;
}

/// The 24 bytes of a GoalInfo, in ROS 1's terms.
GoalInfo goalInfoAt(const std::uint8_t* bytes) {
  GoalInfo info;
  std::copy_n(bytes, info.uuid.size(), info.uuid.begin());
  info.stamp = Stamp::fromParts(loadNumber<std::uint32_t>(bytes + 16),
                                loadNumber<std::uint32_t>(bytes + 20));
  return info;
}

}  // namespace

std::string goalIdOf(const GoalUuid& uuid) {
  std::string id;
  for (const std::uint8_t byte : uuid) {
    id += kHexDigits[byte >> 4];
    id += kHexDigits[byte & 15];
  }
  return id;
}

std::optional<GoalUuid> goalUuidOf(std::string_view id) {
  GoalUuid uuid{};
  if (id.size() != 2 * uuid.size()) return std::nullopt;
  for (std::size_t i = 0; i < id.size(); ++i) {
    const std::size_t digit = kHexDigits.find(id[i]);
    if (digit == std::string_view::npos) return std::nullopt;
    uuid[i / 2] = static_cast<std::uint8_t>(uuid[i / 2] << 4 | digit);
  }
  return uuid;
}

std::optional<GoalState> goalStateOf(std::int8_t ros2_status) {
  switch (ros2_status) {
    case 1:
      return GoalState::Pending;
    case 2:
      return GoalState::Active;
    case 3:
      return GoalState::Preempting;
    case 4:
      return GoalState::Succeeded;
    case 5:
      return GoalState::Preempted;
    case 6:
      return GoalState::Aborted;
    default:
      return std::nullopt;
  }
}

bool isFinal(GoalState state) {
  return state == GoalState::Preempted || state == GoalState::Succeeded ||
         state == GoalState::Aborted || state == GoalState::Rejected ||
         state == GoalState::Recalled;
}

Bytes actionGoalMessage(Stamp now, const ActionGoal& goal) {
  return MessageBytes().header(now).goalId(goal.id).bytes(goal.goal).take();
}

ActionGoal readActionGoal(const Bytes& ros1) {
  static const Schema kHead =
      Schema::parse("actionlib_msgs/ActionGoal", "Header header\ntime stamp\nstring id\n");
  WireReader reader(kHead, ros1);
  reader.skipField(kHead.root().fields[0]);
  ActionGoalId id = readGoalId(reader);
  const std::uint8_t* rest = reader.take(0);
  return {std::move(id), Bytes(rest, rest + reader.left())};
}

Bytes actionUpdateMessage(Stamp now, const ActionGoalStatus& status, const Bytes& part) {
  return MessageBytes().header(now).status(status).bytes(part).take();
}

Bytes statusListMessage(Stamp now, const std::vector<ActionGoalStatus>& goals) {
  MessageBytes message;
  message.header(now).number(static_cast<std::uint32_t>(goals.size()));
  for (const ActionGoalStatus& goal : goals) message.status(goal);
  return message.take();
}

Bytes goalIdMessage(const ActionGoalId& id) { return MessageBytes().goalId(id).take(); }

ActionGoalId readGoalId(const Bytes& ros1) {
  static const Schema kSchema = Schema::parse("actionlib_msgs/GoalID", "time stamp\nstring id\n");
  WireReader reader(kSchema, ros1);
  ActionGoalId id = readGoalId(reader);
  reader.finish();
  return id;
}

bool readIsAccepted(const Bytes& send_goal_reply) {
  return goalReply().toRos1(send_goal_reply).front() != 0;
}

Bytes resultRequest(const GoalUuid& uuid) {
  return resultRequestConversion().toRos2(Bytes(uuid.begin(), uuid.end()));
}

Bytes cancelRequest(const GoalUuid& uuid) {
  Bytes bytes(uuid.begin(), uuid.end());
  bytes.resize(bytes.size() + 8);  // no stamp
  return cancelRequestConversion().toRos2(bytes);
}

GoalInfo readCancelRequest(const Bytes& cdr) {
  return goalInfoAt(cancelRequestConversion().toRos1(cdr).data());
}

std::int8_t readCancelReply(const Bytes& cdr) {
  return static_cast<std::int8_t>(cancelReply().toRos1(cdr).front());
}

std::vector<Ros2GoalStatus> readStatusList(const Bytes& cdr) {
  constexpr std::size_t kEach = 25;
  const Bytes bytes = statusList().toRos1(cdr);
  std::vector<Ros2GoalStatus> goals;
  for (std::size_t at = sizeof(std::uint32_t); at < bytes.size(); at += kEach) {
    goals.push_back({goalInfoAt(&bytes[at]), static_cast<std::int8_t>(bytes[at + kEach - 1])});
  }
  return goals;
}

}  // namespace afterglow::replay
