#include "replay/ros2/action_messages.hpp"

#include <algorithm>
#include <cstddef>

#include "replay/messages/schema.hpp"
#include "replay/messages/wire.hpp"
#include "replay/ros2/cdr_conversion.hpp"

namespace afterglow::replay {
namespace {

constexpr std::string_view kHexDigits = "0123456789abcdef";
const std::string kHeaderField = "Header header\n";
/// The fields of actionlib_msgs/GoalStatus, those of its goal's id among them.
const std::string kGoalStatus = "time stamp\nstring id\nuint8 status\nstring text\n";

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
  template <typename Container>
  MessageBytes& bytes(const Container& bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  MessageBytes& goalInfo(const GoalInfo& info) { return bytes(info.uuid).stamp(info.stamp); }
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

ActionGoalStatus readStatus(WireReader& reader) {
  ActionGoalStatus status;
  status.goal = readGoalId(reader);
  const auto state = reader.number<std::uint8_t>();
  if (state > static_cast<std::uint8_t>(GoalState::Lost)) {
    reader.fail("holds the status " + std::to_string(state) + ", none of actionlib's");
  }
  status.state = static_cast<GoalState>(state);
  status.text = reader.string();
  return status;
}

/// What is left of the message.
Bytes restOf(WireReader& reader) {
  const std::size_t left = reader.left();
  const std::uint8_t* rest = reader.take(left);
  return {rest, rest + left};
}

/// A message of ROS 2 whose fields have the same names and types in ROS 1's terms.
CdrConversion plainConversion(const std::string& type, const std::string& definition) {
  const Schema schema = Schema::parse(type, definition);
  return {schema, schema};
}

const std::string kGoalInfo = "===\nMSG: action_msgs/GoalInfo\nuint8[16] goal_id\ntime stamp\n";

const CdrConversion& goalReplyConversion() {
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
const CdrConversion& cancelReplyConversion() {
  static const auto kConversion = plainConversion(
      "action_msgs/CancelGoal_Response", "int8 return_code\nGoalInfo[] goals\n" + kGoalInfo);
  return kConversion;
}
const CdrConversion& statusListConversion() {
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

std::int8_t ros2StatusOf(GoalState state) {
  switch (state) {
    case GoalState::Pending:
      return 1;
    case GoalState::Active:
      return 2;
    case GoalState::Preempting:
    case GoalState::Recalling:
      return 3;
    case GoalState::Succeeded:
      return 4;
    case GoalState::Preempted:
    case GoalState::Recalled:
      return 5;
    default:
      return 6;
  }
}

bool isFinal(GoalState state) { return ros2StatusOf(state) >= 4; }

Bytes actionGoalMessage(Stamp now, const ActionGoal& goal) {
  return MessageBytes().header(now).goalId(goal.id).bytes(goal.goal).take();
}

ActionGoal readActionGoal(const Bytes& ros1) {
  static const Schema kHead =
      Schema::parse("actionlib_msgs/ActionGoal", kHeaderField + "time stamp\nstring id\n");
  WireReader reader(kHead, ros1);
  reader.skipField(kHead.root().fields[0]);
  ActionGoalId id = readGoalId(reader);
  return {std::move(id), restOf(reader)};
}

Bytes actionUpdateMessage(Stamp now, const ActionGoalStatus& status, const Bytes& part) {
  return MessageBytes().header(now).status(status).bytes(part).take();
}

std::pair<ActionGoalStatus, Bytes> readActionUpdate(const Bytes& ros1) {
  static const Schema kHead =
      Schema::parse("actionlib_msgs/ActionResult", kHeaderField + kGoalStatus);
  WireReader reader(kHead, ros1);
  reader.skipField(kHead.root().fields[0]);
  ActionGoalStatus status = readStatus(reader);
  return {std::move(status), restOf(reader)};
}

Bytes statusListMessage(Stamp now, const std::vector<ActionGoalStatus>& goals) {
  MessageBytes message;
  message.header(now).number(static_cast<std::uint32_t>(goals.size()));
  for (const ActionGoalStatus& goal : goals) message.status(goal);
  return message.take();
}

std::vector<ActionGoalStatus> readStatusListMessage(const Bytes& ros1) {
  static const Schema kSchema = Schema::parse(
      "actionlib_msgs/GoalStatusArray",
      kHeaderField + "GoalStatus[] status_list\n===\nMSG: actionlib_msgs/GoalStatus\n" +
          kGoalStatus);
  WireReader reader(kSchema, ros1);
  reader.skipField(kSchema.root().fields[0]);
  std::vector<ActionGoalStatus> goals;
  for (std::size_t left = reader.count(kSchema.root().fields[1]); left > 0; --left) {
    goals.push_back(readStatus(reader));
  }
  reader.finish();
  return goals;
}

Bytes goalIdMessage(const ActionGoalId& id) { return MessageBytes().goalId(id).take(); }

ActionGoalId readGoalId(const Bytes& ros1) {
  static const Schema kSchema = Schema::parse("actionlib_msgs/GoalID", "time stamp\nstring id\n");
  WireReader reader(kSchema, ros1);
  ActionGoalId id = readGoalId(reader);
  reader.finish();
  return id;
}

Bytes goalReply(bool is_accepted, Stamp stamp) {
  const auto accepted = static_cast<std::uint8_t>(is_accepted);
  return goalReplyConversion().toRos2(MessageBytes().number(accepted).stamp(stamp).take());
}

bool readIsAccepted(const Bytes& send_goal_reply) {
  return goalReplyConversion().toRos1(send_goal_reply).front() != 0;
}

Bytes resultRequest(const GoalUuid& uuid) {
  return resultRequestConversion().toRos2(Bytes(uuid.begin(), uuid.end()));
}

GoalUuid readResultRequest(const Bytes& cdr) {
  GoalUuid uuid;
  std::copy_n(resultRequestConversion().toRos1(cdr).data(), uuid.size(), uuid.begin());
  return uuid;
}

Bytes cancelRequest(const GoalUuid& uuid) {
  return cancelRequestConversion().toRos2(MessageBytes().goalInfo({uuid, {}}).take());
}

GoalInfo readCancelRequest(const Bytes& cdr) {
  return goalInfoAt(cancelRequestConversion().toRos1(cdr).data());
}

Bytes cancelReply(CancelCode code, const std::vector<GoalInfo>& canceling) {
  MessageBytes message;
  message.number(static_cast<std::int8_t>(code));
  message.number(static_cast<std::uint32_t>(canceling.size()));
  for (const GoalInfo& goal : canceling) message.goalInfo(goal);
  return cancelReplyConversion().toRos2(message.take());
}

CancelCode readCancelReply(const Bytes& cdr) {
  return static_cast<CancelCode>(cancelReplyConversion().toRos1(cdr).front());
}

Bytes statusList(const std::vector<Ros2GoalStatus>& goals) {
  MessageBytes message;
  message.number(static_cast<std::uint32_t>(goals.size()));
  for (const Ros2GoalStatus& goal : goals) message.goalInfo(goal.goal).number(goal.status);
  return statusListConversion().toRos2(message.take());
}

std::vector<Ros2GoalStatus> readStatusList(const Bytes& cdr) {
  constexpr std::size_t kEach = 25;
  const Bytes bytes = statusListConversion().toRos1(cdr);
  std::vector<Ros2GoalStatus> goals;
  for (std::size_t at = sizeof(std::uint32_t); at < bytes.size(); at += kEach) {
    goals.push_back({goalInfoAt(&bytes[at]), static_cast<std::int8_t>(bytes[at + kEach - 1])});
  }
  return goals;
}

}  // namespace afterglow::replay
