#include "nodes/guard/guard_messages.hpp"

#include <gtest/gtest.h>

#include <string>

#include "nodes/guard/guard_socket.hpp"
#include "replay/messages/definitions.hpp"
#include "replay/messages/document.hpp"
#include "replay/messages/schema.hpp"
#include "tests/support/ros_bytes.hpp"

namespace afterglow::nodes::guard_messages_test {
namespace {

using test::rosBytes;

template <typename Message>
std::string md5OfDefinition() {
  namespace traits = ros::message_traits;
  return replay::definitionMd5(traits::DataType<Message>::value(),
                               traits::Definition<Message>::value());
}

/// The message, read by its definition.
template <typename Message>
std::string read(const Message& message) {
  namespace traits = ros::message_traits;
  const auto schema = replay::Schema::parse(traits::DataType<Message>::value(),
                                            traits::Definition<Message>::value());
  const replay::Value value = replay::decode(schema, rosBytes(message));
  return rosBytes(message) == replay::encode(schema, value) ? "as it is defined" : "otherwise";
}

TEST(GuardMessages, haveTheMd5OfTheirDefinitions) {
  using ros::message_traits::MD5Sum;
  EXPECT_EQ(md5OfDefinition<GuardOutputs>(), MD5Sum<GuardOutputs>::value());
  EXPECT_EQ(md5OfDefinition<GuardBeat>(), MD5Sum<GuardBeat>::value());
  EXPECT_EQ(md5OfDefinition<GuardAnswer>(), MD5Sum<GuardAnswer>::value());
}

TEST(GuardMessages, areWrittenAsTheyAreDefined) {
  GuardOutputs outputs;
  outputs.name = "/player";
  outputs.outputs.resize(2);
  outputs.outputs[1] = {"/cmd_vel", "geometry_msgs/Twist", "md5", "Vector3 linear", {1, 2, 3}};
  EXPECT_EQ(read(outputs), "as it is defined");
  GuardBeat beat;
  beat.moving = {0, 7};
  EXPECT_EQ(read(beat), "as it is defined");
  GuardAnswer answer;
  answer.stopped = "the player asked for it";
  answer.heard_by = {1};
  EXPECT_EQ(read(answer), "as it is defined");
}

TEST(GuardMessages, areReadAsTheyWereWritten) {
  GuardBeat beat;
  beat.player = 1ull << 63;
  beat.count = 4;
  beat.sent_ns = 5;
  beat.patience_ms = 150;
  beat.stop = 1;
  beat.moving = {3, 1};
  replay::Bytes bytes = rosBytes(beat);
  ros::serialization::IStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  GuardBeat again;
  ros::serialization::deserialize(stream, again);
  EXPECT_EQ(again.player, beat.player);
  EXPECT_EQ(again.count, beat.count);
  EXPECT_EQ(again.sent_ns, beat.sent_ns);
  EXPECT_EQ(again.patience_ms, beat.patience_ms);
  EXPECT_EQ(again.stop, beat.stop);
  EXPECT_EQ(again.moving, beat.moving);
}

TEST(GuardSocket, keepsMessagesWholeAndShowsThatTheOtherSideIsGone) {
  const auto [ours, its] = GuardSocket::makePair();
  GuardSocket guard(its);
  GuardOutputs told, heard;
  GuardBeat beat;
  {
    GuardSocket player(ours);
    told.outputs.resize(20, {"/cmd_vel", "geometry_msgs/Twist", "md5", std::string(3000, 'x'), {1}});
    player.send(told);
    beat.count = 7;
    player.send(beat);
  }
  GuardSocket::Packet packet = guard.receive();
  EXPECT_FALSE(GuardSocket::read(packet, beat));
  ASSERT_TRUE(GuardSocket::read(packet, heard));
  EXPECT_EQ(heard.outputs.size(), 20u);
  EXPECT_EQ(heard.outputs.back().definition, told.outputs.back().definition);
  packet = guard.receive();
  EXPECT_TRUE(GuardSocket::read(packet, beat));
  EXPECT_EQ(beat.count, 7u);
  EXPECT_FALSE(guard.isClosed()) << "what was said last is heard first";
  EXPECT_TRUE(guard.receive().empty());
  EXPECT_TRUE(guard.isClosed());
}

TEST(GuardSocket, isOpenWhileNothingComesAndClosedForASenderOnceTheOtherSideIsGone) {
  const auto [ours, its] = GuardSocket::makePair();
  GuardSocket player(ours);
  {
    const GuardSocket guard(its);
    EXPECT_TRUE(player.receive().empty());
    player.send(GuardBeat());
    EXPECT_FALSE(player.isClosed());
  }
  player.send(GuardBeat());
  EXPECT_TRUE(player.isClosed());
}

TEST(GuardSocket, showsThatTheOtherSideIsGoneWhereNothingEverCame) {
  const auto [ours, its] = GuardSocket::makePair();
  GuardSocket player(ours);
  {
    const GuardSocket guard(its);
    EXPECT_TRUE(player.receive().empty());
  }
  EXPECT_TRUE(player.receive().empty());
  EXPECT_TRUE(player.isClosed());
}

TEST(GuardSocket, showsThatTheOtherSideDiedBeforeItReadAll) {
  const auto [ours, its] = GuardSocket::makePair();
  GuardSocket player(ours);
  {
    const GuardSocket guard(its);
    player.send(GuardBeat());
  }
  EXPECT_TRUE(player.receive().empty()) << "the connection was reset";
  EXPECT_TRUE(player.isClosed());
}

TEST(GuardSocket, neverWaitsForOneThatDoesNotRead) {
  const auto [ours, its] = GuardSocket::makePair();
  GuardSocket guard(its), player(ours);
  for (int i = 0; i < 10000; ++i) player.send(GuardBeat());
  EXPECT_FALSE(player.isClosed()) << "beats are lost, and are not answered";
}

}  // namespace
}  // namespace afterglow::nodes::guard_messages_test
