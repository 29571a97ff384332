// The Foxglove WebSocket protocol without sockets: its frames, a stored behavior's playback, and
// who may open it.
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "nodes/console/console_access.hpp"
#include "nodes/console/foxglove_playback.hpp"
#include "replay/messages/wire.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::nodes::foxglove_test {
namespace {

using namespace afterglow::test;
using nlohmann::json;
using Status = PlaybackState::Status;

constexpr std::int64_t kSecond = 1'000'000'000;

template <typename T>
T numberAt(const std::string& bytes, std::size_t at) {
  return replay::loadNumber<T>(reinterpret_cast<const std::uint8_t*>(bytes.data()) + at);
}

/// A frame of the server, read.
struct Heard {
  json told = json::object();  ///< of texts
  char kind = 0;               ///< of binary frames
  std::uint32_t id = 0;        ///< a message's subscription
  std::int64_t at = 0;
  std::string text;  ///< a message's std_msgs/String; the id that a state answers
  Status status = Status::Playing;
  bool has_sought = false;
};

Heard heardFrom(const SocketFrame& frame) {
  Heard heard;
  if (frame.is_text) {
    heard.told = json::parse(frame.bytes);
    return heard;
  }
  heard.kind = frame.bytes.at(0);
  if (heard.kind == 1) {
    heard.id = numberAt<std::uint32_t>(frame.bytes, 1);
    heard.at = numberAt<std::int64_t>(frame.bytes, 5);
    heard.text = frame.bytes.substr(kMessageOffset + 4);
  } else if (heard.kind == 2) {
    heard.at = numberAt<std::int64_t>(frame.bytes, 1);
  } else {
    heard.status = static_cast<Status>(frame.bytes.at(1));
    heard.at = numberAt<std::int64_t>(frame.bytes, 2);
    heard.has_sought = frame.bytes.at(14) == 1;
    heard.text = frame.bytes.substr(19);
  }
  return heard;
}

/// A behavior of 100 s: /count says its second, /said a word that is latched, at 0.5 s.
class FoxglovePlaybackOf : public testing::Test {
 protected:
  FoxglovePlaybackOf() : store_(replay::openMemoryStore()) {
    const auto recording = store_->addRecording({});
    const auto count = store_->addChannel(recording, stringChannel("/count"));
    const auto said = store_->addChannel(recording, stringChannel("/said", "/talker", true));
    std::vector<replay::Message> messages{stringMessage(said, kSecond / 2, 1000, "word")};
    for (int at = 0; at < 100; ++at) {
      messages.push_back(
          stringMessage(count, at * kSecond, static_cast<std::uint64_t>(at), std::to_string(at)));
    }
    store_->append(messages);
    auto behavior = sampleBehavior(recording, {"/count", "/said"}, 0, 100 * kSecond);
    behavior.parameters = R"({"part": "gear"})";
    behavior_ = store_->addBehavior(behavior);
  }

  void open(const PlaybackStart& start = {}) {
    playback_ = std::make_unique<FoxglovePlayback>(*store_, store_->behavior(behavior_).value(),
                                                   frames_, start);
    info_ = await("serverInfo").told;
    topics_ = await("advertise").told["channels"];
  }
  void send(const json& told) { playback_->take({true, told.dump()}); }
  void subscribe(std::uint32_t id, const std::string& topic) {
    send({{"op", "subscribe"},
          {"subscriptions", {{{"id", id}, {"channelId", topic == "/said" ? 2 : 1}}}}});
  }
  Heard await(const std::string& op) {
    return await([&](const Heard& one) { return one.told.value("op", "") == op; });
  }
  void control(bool plays, double speed, std::optional<std::int64_t> seek, const std::string& id) {
    std::string bytes(19, '\0');
    auto* data = reinterpret_cast<std::uint8_t*>(bytes.data());
    data[0] = 3;
    data[1] = plays ? 0 : 1;
    replay::storeNumber(data + 2, static_cast<float>(speed));
    data[6] = seek ? 1 : 0;
    replay::storeNumber(data + 7, static_cast<std::uint64_t>(seek.value_or(0)));
    replay::storeNumber(data + 15, static_cast<std::uint32_t>(id.size()));
    playback_->take({false, bytes + id});
  }

  /// Waits for a frame; all before it are heard, too.
  Heard await(const std::function<bool(const Heard&)>& is_it) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (std::chrono::steady_clock::now() < deadline) {
      const auto frame = frames_->take();
      if (!frame) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        continue;
      }
      heard_.push_back(heardFrom(*frame));
      if (is_it(heard_.back())) return heard_.back();
    }
    throw std::runtime_error("the frame did not come");
  }
  Heard awaitState(const std::string& id) {
    return await([&](const Heard& one) { return one.kind == 5 && one.text == id; });
  }
  void awaitEnd() {
    await([](const Heard& one) { return one.kind == 5 && one.status == Status::Ended; });
  }
  std::vector<std::string> texts(std::uint32_t id) const {
    std::vector<std::string> texts;
    for (const Heard& one : heard_) {
      if (one.kind == 1 && one.id == id) texts.push_back(one.text);
    }
    return texts;
  }

  std::unique_ptr<replay::Store> store_;
  std::int64_t behavior_ = 0;
  std::shared_ptr<FrameQueue> frames_ = std::make_shared<FrameQueue>();
  std::unique_ptr<FoxglovePlayback> playback_;
  json info_, topics_;
  std::vector<Heard> heard_;
};

TEST_F(FoxglovePlaybackOf, aBehaviorTellsWhatItIsAndItsTopics) {
  open();
  EXPECT_EQ(info_["dataEndTime"], json({{"sec", 100}, {"nsec", 0}}));
  ASSERT_EQ(topics_.size(), 2U);
  EXPECT_EQ(topics_[0]["topic"], "/count");
  EXPECT_EQ(topics_[0]["encoding"], "ros1");
  EXPECT_EQ(topics_[0]["schemaName"], "std_msgs/String");
  EXPECT_EQ(topics_[0]["schema"], "string data\n");
  EXPECT_EQ(awaitState("").status, Status::Playing);
}

TEST_F(FoxglovePlaybackOf, aBehaviorSendsAllMessagesInOrderAndTimeNeverGoesBack) {
  open({0, 1000, true});
  subscribe(7, "/count");
  awaitEnd();
  std::vector<std::string> all;
  for (int at = 0; at < 100; ++at) all.push_back(std::to_string(at));
  EXPECT_EQ(texts(7), all);
  std::int64_t time = 0;
  for (const Heard& one : heard_) {
    if (one.kind == 1) {
      EXPECT_EQ(one.at, time);
    } else if (one.kind == 2) {
      EXPECT_GT(one.at, time);
      time = one.at;
    }
  }
  EXPECT_EQ(time, 100 * kSecond);
}

TEST_F(FoxglovePlaybackOf, aBehaviorThatStandsShowsWhatIsInForceThere) {
  open();
  control(false, 1, 50 * kSecond + 1, "seek");
  EXPECT_TRUE(awaitState("seek").has_sought);
  subscribe(1, "/said");
  subscribe(2, "/count");
  await([](const Heard& one) { return one.kind == 1 && one.id == 2; });
  EXPECT_EQ(texts(1), std::vector<std::string>{"word"});
  EXPECT_EQ(texts(2), std::vector<std::string>{"50"});
  control(false, 1, 20 * kSecond, "back");
  const Heard state = awaitState("back");
  EXPECT_EQ(state.at, 20 * kSecond);
  EXPECT_EQ(state.status, Status::Paused);
  await([](const Heard& one) { return one.kind == 1 && one.id == 2; });
  EXPECT_EQ(texts(2).back(), "20");
  control(true, 1000, std::nullopt, "on");
  EXPECT_FALSE(awaitState("on").has_sought);
  awaitEnd();
  EXPECT_EQ(texts(2).size(), 2U + 79U);
  control(true, 1000, std::nullopt, "again");
  EXPECT_EQ(awaitState("again").at, 0);
}

TEST_F(FoxglovePlaybackOf, aBehaviorEndsSubscriptions) {
  open();
  control(false, 1, std::nullopt, "stand");
  subscribe(1, "/count");
  subscribe(2, "/said");
  send({{"op", "unsubscribe"}, {"subscriptionIds", {1}}});
  control(true, 1000, std::nullopt, "on");
  awaitEnd();
  EXPECT_EQ(texts(2), std::vector<std::string>{"word"});
  EXPECT_TRUE(texts(1).empty());
}

TEST_F(FoxglovePlaybackOf, aBehaviorWaitsForASlowClient) {
  const auto recording = store_->addRecording({});
  const auto big = store_->addChannel(recording, stringChannel("/big"));
  std::vector<replay::Message> messages;
  for (int at = 0; at < 40; ++at) {
    messages.push_back(
        stringMessage(big, at + 1, static_cast<std::uint64_t>(at), std::string(256 << 10, 'x')));
  }
  store_->append(messages);
  behavior_ = store_->addBehavior(sampleBehavior(recording, {"/big"}, 0, 100));
  open();
  subscribe(1, "/big");
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (frames_->hasRoom() && std::chrono::steady_clock::now() < deadline)
    std::this_thread::yield();
  EXPECT_FALSE(frames_->hasRoom());
  awaitEnd();
  EXPECT_EQ(texts(1).size(), 40U);
  EXPECT_FALSE(frames_->isClosed());
}

TEST_F(FoxglovePlaybackOf, aBehaviorChangesNothing) {
  open();
  subscribe(1, "/count");
  for (const json& asked :
       {json{{"op", "advertise"}, {"channels", json::array()}},
        json{{"op", "subscribe"}, {"subscriptions", {{{"id", 2}, {"channelId", 9}}}}},
        json{{"op", "subscribe"}, {"subscriptions", {{{"id", 1}, {"channelId", 2}}}}},
        json{{"op", "setParameters"}, {"parameters", {{{"name", "/behavior/name"}, {"value", 1}}}}},
        json{{"op", "fetchAsset"}, {"uri", "package://a"}, {"requestId", 1}}}) {
    send(asked);
    EXPECT_EQ(await("status").told["level"], 2);
  }
  send({{"op", "getParameters"}, {"parameterNames", {"/behavior/parameters/part"}}, {"id", "x"}});
  const json values = await([](const Heard& one) { return one.told.value("id", "") == "x"; }).told;
  EXPECT_EQ(values["parameters"],
            json({{{"name", "/behavior/parameters/part"}, {"value", "gear"}}}));
}

TEST_F(FoxglovePlaybackOf, aBehaviorSendsNoStatesToThoseWhoKnowNone) {
  open({0, 1000, false});
  subscribe(1, "/said");
  await([](const Heard& one) { return one.kind == 1; });
  for (const Heard& one : heard_) EXPECT_NE(one.kind, 5);
  EXPECT_THROW(open({0, 0, true}), std::runtime_error);
}

// The bytes are those of foxglove-sdk's own tests of its encoding.
TEST(FoxgloveFrames, areThoseOfTheSdk) {
  const std::string asked{
      "\x03\x00\x00\x00\x80\x3f\x01\x15\xcd\x5b\x07\x00\x00\x00\x00\x07\x00\x00\x00some-id", 26};
  const auto request = std::get<PlaybackRequest>(readFoxglove({false, asked}));
  EXPECT_TRUE(request.plays);
  EXPECT_EQ(request.speed, 1);
  EXPECT_EQ(request.seek, replay::Stamp{123456789});
  EXPECT_EQ(request.id, "some-id");
  const std::string told{
      "\x05\x00\x39\x30\x00\x00\x00\x00\x00\x00\x00\x00\x80\x3f\x01\x00\x00\x00\x00", 19};
  EXPECT_EQ(playbackStateFrame({Status::Playing, {12345}, 1, true, ""}).bytes, told);
}

TEST(FoxgloveFrames, areRefusedInALineWhenTheyMakeNoSense) {
  for (const char* text :
       {"", "{", "7", "{\"op\":7}", "{\"op\":\"subscribe\"}", "{\"op\":\"dance\"}",
        "{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":-1,\"channelId\":1}]}",
        "{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":1.5,\"channelId\":1}]}",
        "{\"op\":\"unsubscribe\",\"subscriptionIds\":[4294967296]}"}) {
    const auto request = readFoxglove({true, text});
    ASSERT_TRUE(std::holds_alternative<RefusedRequest>(request)) << text;
    EXPECT_FALSE(std::get<RefusedRequest>(request).why.empty());
  }
  for (const std::string& bytes : {std::string(), std::string("\x03"),
                                   "\x03" + std::string(30, '\xff'), std::string("\x7f")}) {
    EXPECT_TRUE(std::holds_alternative<RefusedRequest>(readFoxglove({false, bytes})));
  }
}

TEST(FrameQueue, losesTheOldestLiveFramesOfASlowClientAndNoOthers) {
  FrameQueue frames;
  frames.push({true, "kept"});
  std::size_t dropped = 0;
  for (char name = 'a'; name < 'm'; ++name) {
    dropped += frames.pushLive(std::string(1 << 20, name));
    if (name == 'c') frames.push({true, "kept, too"});
  }
  EXPECT_EQ(dropped, 4U);
  EXPECT_EQ(frames.take()->bytes, "kept");
  EXPECT_EQ(frames.take()->bytes, "kept, too");
  EXPECT_EQ(frames.take()->bytes[0], 'e');
  EXPECT_EQ(frames.pushLive(std::string(FrameQueue::kMostLive * 2, 'z')), 7U);  // it goes alone
  EXPECT_EQ(frames.take()->bytes[0], 'z');
}

TEST(FrameQueue, dropsAClientThatTakesNothing) {
  FrameQueue frames;
  for (int i = 0; i < 40 && !frames.isClosed(); ++i)
    frames.push({false, std::string(1 << 20, 'x')});
  EXPECT_TRUE(frames.isClosed());
  EXPECT_FALSE(frames.take());
}

HttpRequest socketFrom(const std::string& origin, const std::string& token = "") {
  HttpRequest request;
  request.headers = {{"host", "127.0.0.1:8080"}};
  if (!origin.empty()) request.headers["origin"] = origin;
  if (!token.empty()) request.query["token"] = token;
  return request;
}

TEST(ConsoleAccess, letsPagesOfOtherSitesReadOnlyIfTheyAreNamedOrKnowTheToken) {
  const ConsoleAccess open("", {}, {"https://App.foxglove.dev"});
  for (const char* origin : {"", "http://127.0.0.1:8080", "file://", "https://app.foxglove.dev"}) {
    EXPECT_FALSE(open.socketRefusal(socketFrom(origin))) << origin;
  }
  for (const char* origin : {"https://evil.example", "null", "http://127.0.0.1:8081"}) {
    EXPECT_EQ(open.socketRefusal(socketFrom(origin)).value().status, 403) << origin;
  }
  EXPECT_EQ(open.socketRefusal(socketFrom("https://evil.example", "")).value().status, 403);
  const ConsoleAccess closed("0123456789abcdef", {});
  EXPECT_EQ(closed.socketRefusal(socketFrom("")).value().status, 401);
  EXPECT_EQ(closed.socketRefusal(socketFrom("", "0123456789abcdee")).value().status, 401);
  EXPECT_FALSE(closed.socketRefusal(socketFrom("https://app.foxglove.dev", "0123456789abcdef")));
  HttpRequest foreign = socketFrom("");
  foreign.headers["host"] = "evil.example";
  EXPECT_EQ(open.socketRefusal(foreign).value().status, 403);
}

}  // namespace
}  // namespace afterglow::nodes::foxglove_test
