// Messages of an action from nowhere: they may not crash, hang, or make us take memory that they do
// not pay for.
// An input is a list of messages: the way it comes (1 byte), a request's number (1 byte), its
// length (2 bytes, little endian), its bytes.
#include <algorithm>

#include "replay/ros2/action_relay.hpp"
#include "replay/ros2/action_relay_to_ros2.hpp"
#include "tests/fuzz/target.hpp"

namespace afterglow::fuzz::action_fuzz {
namespace {

using namespace replay;

ActionType madeUpAction() {
  return {"a/Do",
          {"string name\nfloat64[] points\n", "int32 error\nstring[] why\n", "float64 x\n"},
          [](const std::string&) { return std::nullopt; }};
}

void take(ActionRelay& relay, ActionRelayToRos2& to_ros2, std::uint8_t way, std::uint8_t number,
          const Bytes& bytes) {
  const RequestId id{{static_cast<std::uint8_t>(number >> 7)}, number & 127};
  const auto service = static_cast<ActionService>(way % 3);
  switch (way / 3) {
    case 0:
      return relay.onRequest(service, id, bytes, {1});
    case 1:
      return relay.onReply(service, id, bytes, {1});
    case 2:
      return way == 6   ? relay.onFeedback(bytes, {1})
             : way == 7 ? relay.onStatus(bytes, {1})
                        : relay.tick({1});
    case 3:
      return way == 9    ? relay.onRos1Goal(bytes, {1})
             : way == 10 ? relay.onRos1Cancel(bytes)
                         : relay.onServerGone({1});
    case 4:
      return to_ros2.onRequest(service, id, bytes, {1});
    case 5:
      return way == 15   ? to_ros2.onStatus(bytes, {1})
             : way == 16 ? to_ros2.onFeedback(bytes)
                         : to_ros2.onResult(bytes, {1});
    case 6:
      return way == 18 ? to_ros2.tick({1}) : to_ros2.onServerGone({1});
    default:
      return;
  }
}

}  // namespace

AFTERGLOW_FUZZ_TARGET(action) {
  std::int64_t sent = 0;
  std::uint8_t fresh = 0;
  ActionRelay relay(madeUpAction(), {[&](ActionService, const Bytes&) {
                                       return RequestId{{1}, sent++ & 127};
                                     },
                                     [](ActionTopic, const Bytes&) {}, [](const std::string&) {},
                                     [&] { return GoalUuid{++fresh}; }});
  ActionRelayToRos2 to_ros2(madeUpAction(),
                            {[](ActionService, const RequestId&, const Bytes&) {},
                             [](ActionTopic, const Bytes&) {}, [](ActionTopic, const Bytes&) {},
                             [](const std::string&) {}, [&] { return GoalUuid{++fresh}; }});
  for (std::size_t at = 0; at + 4 <= size;) {
    const std::size_t length =
        std::min<std::size_t>(data[at + 2] | data[at + 3] << 8, size - at - 4);
    const std::uint8_t* begin = data + at + 4;
    take(relay, to_ros2, data[at], data[at + 1], Bytes(begin, begin + length));
    at += 4 + length;
  }
}

}  // namespace afterglow::fuzz::action_fuzz
