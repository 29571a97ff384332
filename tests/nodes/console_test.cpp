// The console's routes, without sockets; and its server's bounds, with them.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "nodes/behavior_view/behavior_story.hpp"
#include "nodes/console/behavior_index.hpp"
#include "nodes/console/console_api.hpp"
#include "nodes/console/http_server.hpp"
#include "replay/messages/document.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::console_test {
namespace {

using namespace afterglow::test;
using nlohmann::json;

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr const char* kToken = "0123456789abcdef";

replay::Channel soundChannel() {
  return {"/robotsound",
          "sound_play/SoundRequest",
          "d098ce4a040686259137ece23a625167",
          "int8 sound\nint8 command\nfloat32 volume\nstring arg\nstring arg2\n",
          false,
          "/speaker"};
}

replay::Message sentence(std::int64_t channel, std::int64_t second, const std::string& text) {
  const replay::Channel sound = soundChannel();
  return {channel, replay::Stamp{second * kSecond}, static_cast<std::uint64_t>(second), {},
          replay::encode(replay::Schema::parse(sound.type, sound.definition),
                         replay::Object{{"sound", std::int8_t{-3}},
                                        {"command", std::int8_t{1}},
                                        {"volume", 1.0F},
                                        {"arg", text},
                                        {"arg2", std::string()}})};
}

const char kGoalDefinition[] = "actionlib_msgs/GoalID goal_id\n"
                               "================\nMSG: actionlib_msgs/GoalID\nstring id\n";
const char kResultDefinition[] =
    "actionlib_msgs/GoalStatus status\n"
    "================\nMSG: actionlib_msgs/GoalStatus\nactionlib_msgs/GoalID goal_id\n"
    "uint8 status\nstring text\n"
    "================\nMSG: actionlib_msgs/GoalID\nstring id\n";

/// A store with two picks: the first failed.
class Console : public testing::Test {
 protected:
  Console() : store_(replay::openStore(path_, replay::OpenMode::ReadWrite)) {
    const auto recording = store_->addRecording({0, "", "robot", ""});
    const auto sound = store_->addChannel(recording, soundChannel());
    goal_ = store_->addChannel(
        recording, {"/arm/goal", "my_msgs/ArmActionGoal", "1", kGoalDefinition, false, "/task"});
    result_ = store_->addChannel(recording, {"/arm/result", "my_msgs/ArmActionResult", "2",
                                             kResultDefinition, false, "/arm"});
    store_->append({sentence(sound, 101, "I take the gear for Zo\xc3\xab"), goalMessage(goal_, 102),
                    resultMessage(result_, 104, 4, "too far"),
                    sentence(sound, 201, "<b>I have it</b>"), goalMessage(goal_, 202),
                    resultMessage(result_, 203, 3, "")});
    failed_ = add(recording, 100, "failure", R"({"part": "gear"})");
    succeeded_ = add(recording, 200, "success", R"({"part": "bolt"})");
    index_ = std::make_unique<BehaviorIndex>(*store_);
    index_->read();
  }

  std::int64_t add(std::int64_t recording, std::int64_t second, const std::string& outcome,
                   const std::string& parameters) {
    auto behavior = sampleBehavior(recording, {"/robotsound", "/arm/goal", "/arm/result"},
                                   second * kSecond, (second + 8) * kSecond);
    behavior.outcome = outcome;
    behavior.parameters = parameters;
    return store_->addBehavior(behavior);
  }
  static replay::Message goalMessage(std::int64_t channel, std::int64_t second) {
    return {channel, replay::Stamp{second * kSecond}, static_cast<std::uint64_t>(second), {},
            replay::encode(replay::Schema::parse("my_msgs/ArmActionGoal", kGoalDefinition),
                           replay::Object{{"goal_id", replay::Object{{"id", std::string("g")}}}})};
  }
  static replay::Message resultMessage(std::int64_t channel, std::int64_t second,
                                       std::uint8_t status, const std::string& text) {
    const replay::Object goal_id = {{"id", std::string("g")}};
    return {channel, replay::Stamp{second * kSecond}, static_cast<std::uint64_t>(second), {},
            replay::encode(
                replay::Schema::parse("my_msgs/ArmActionResult", kResultDefinition),
                replay::Object{{"status", replay::Object{{"goal_id", goal_id},
                                                         {"status", status},
                                                         {"text", text}}}})};
  }

  HttpResponse send(HttpRequest request, const std::string& token = "") {
    request.headers.emplace("host", "localhost:8080");
    ConsoleApi api(*store_, *index_, ConsoleAccess(token, {}), {"1", "a store", "no pictures"});
    if (speak_) api.setSpeech(speak_);
    HttpResponse answer{0, "", "never answered"};
    api.answer(request, [&answer](HttpResponse response) { answer = std::move(response); });
    return answer;
  }
  HttpResponse get(const std::string& target) {
    HttpRequest request;
    readTarget(target, request);
    return send(request);
  }
  json answer(const std::string& target) { return json::parse(get(target).body); }
  std::vector<std::int64_t> found(const std::string& query) {
    std::vector<std::int64_t> ids;
    const json listed = answer("/api/behaviors?" + query);
    for (const auto& one : listed["behaviors"]) ids.push_back(one["id"]);
    return ids;
  }
  std::string error(const std::string& target, int status) {
    const HttpResponse response = get(target);
    EXPECT_EQ(response.status, status) << target;
    return json::parse(response.body).value("error", "");
  }

  TempFolder folder_;
  std::int64_t goal_ = 0, result_ = 0;  ///< channels
  Speak speak_;
  const std::string path_ = folder_.path("store.db");
  std::unique_ptr<replay::Store> store_;
  std::int64_t failed_ = 0, succeeded_ = 0;
  std::unique_ptr<BehaviorIndex> index_;
};

using Ids = std::vector<std::int64_t>;

TEST_F(Console, findsBehaviorsByAnyWordsCapitalsAndAccentsAside) {
  EXPECT_EQ(found(""), (Ids{succeeded_, failed_}));
  EXPECT_EQ(found("q=ZOE%20gear"), Ids{failed_});
  EXPECT_EQ(found("q=outcome:succ"), Ids{succeeded_});
  EXPECT_EQ(found("q=part%20bolt"), Ids{succeeded_});
  EXPECT_EQ(found("q=said:bolt"), Ids{});
  EXPECT_EQ(found("q=%22I+have%22"), Ids{succeeded_});
  EXPECT_EQ(found("name=pick&limit=1"), Ids{succeeded_});
  EXPECT_EQ(found("limit=1&before=" + std::to_string(succeeded_)), Ids{failed_});
  EXPECT_EQ(found("where=%7B%22/arm/result%22:%7B%22status.status%22:4%7D%7D"), Ids{failed_});
  EXPECT_EQ(answer("/api/behaviors?q=pick&limit=0")["matching"], 2);
}

TEST_F(Console, seesBehaviorsThatComeWhileItRuns) {
  add(1, 300, "success", "{}");
  index_->read();
  EXPECT_EQ(answer("/api/behaviors")["total"], 3);
  store_->removeBehavior(failed_);
  index_->read();
  EXPECT_EQ(answer("/api/behaviors")["total"], 2);
}

TEST_F(Console, tellsABehaviorAsAStory) {
  const json detail = answer("/api/behaviors/" + std::to_string(failed_));
  std::vector<std::string> texts;
  for (const auto& entry : detail["story"]) texts.push_back(entry["text"]);
  EXPECT_EQ(texts,
            (std::vector<std::string>{
                "began pick (part: gear)", "said \"I take the gear for Zo\xc3\xab\"",
                "did not move the arm: aborted after 2.0 s: too far", "failure after 8.0 s"}));
  EXPECT_EQ(detail["lanes"][0]["topic"], "/arm/goal");
  EXPECT_EQ(detail["lanes"][0]["spans"][0]["from"], 2.0);
  EXPECT_EQ(detail["lanes"][0]["spans"][0]["to"], 4.0);
  EXPECT_EQ(detail["lanes"][0]["spans"][0]["text"], "goal 1: aborted (too far)");
  EXPECT_EQ(detail["said"][0]["t"], 1.0);
  EXPECT_EQ(detail["begin"], "100000000000");
}

TEST_F(Console, tellsGoalsThatFollowedOneAnotherAsOne) {
  store_->append({goalMessage(goal_, 204), resultMessage(result_, 205, 3, "")});
  index_->read();
  const json detail = answer("/api/behaviors/" + std::to_string(succeeded_));
  EXPECT_EQ(detail["story"][2]["text"], "moved the arm 2 times in 3.0 s");
  EXPECT_EQ(detail["story"][2]["t"], 2.0);
}

TEST_F(Console, tellsNumbersOverTime) {
  const std::string path = "/api/behaviors/" + std::to_string(failed_) + "/values?topic=";
  const json told = answer(path + "/arm/result");
  EXPECT_EQ(told["t"], json::array({4.0}));
  EXPECT_EQ(told["fields"]["status.status"], json::array({4.0}));
  EXPECT_FALSE(told["fields"].contains("header.seq"));
  EXPECT_TRUE(told["whole"]);
  EXPECT_TRUE(answer(path + "/arm/result&from=4.1")["t"].empty());
  EXPECT_TRUE(answer(path + "/none")["t"].empty());
  EXPECT_EQ(error(path, 400), "topic is missing");
  EXPECT_EQ(error(path + "/arm/result&to=x", 400), "to should be a number of seconds");
}

TEST_F(Console, speaksWhatWasSaid) {
  const std::string path = "/api/behaviors/" + std::to_string(failed_) + "/sound";
  EXPECT_EQ(error(path, 404), "there is nothing at this address");
  speak_ = [](const std::string& text) { return "spoken: " + text; };
  EXPECT_EQ(get(path + "?n=0").body, "spoken: I take the gear for Zo\xc3\xab");
  EXPECT_EQ(error(path + "?n=1", 404), "it said nothing of this number");
}

TEST_F(Console, saysWhatTwoBehaviorsHaveNotInCommon) {
  const json both = answer("/api/compare?a=" + std::to_string(failed_) +
                           "&b=" + std::to_string(succeeded_));
  EXPECT_EQ(both["parameters"][0], json({{"key", "part"},
                                         {"a", "gear"},
                                         {"b", "bolt"},
                                         {"differs", true}}));
  EXPECT_EQ(both["topics"][0]["differs"], false);
  EXPECT_EQ(both["duration"]["a"], 8.0);
}

TEST_F(Console, showsTheNewestMessageAtAMoment) {
  const std::string path = "/api/behaviors/" + std::to_string(failed_) + "/message?topic=";
  EXPECT_EQ(answer(path + "/arm/result&t=7.5")["value"]["status"]["text"], "too far");
  EXPECT_EQ(answer(path + "/arm/result&t=4")["t"], 4.0);
  EXPECT_EQ(error(path + "/arm/result&t=3.9", 404), "nothing was heard on this topic until then");
  EXPECT_EQ(error(path + "/none&t=3", 404), "nothing was heard on this topic until then");
}

TEST_F(Console, refusesWhatMakesNoSense) {
  EXPECT_EQ(error("/api/behaviors/77", 404), "there is no behavior of this id");
  EXPECT_EQ(error("/api/behaviors/x", 404), "a behavior's id is a whole number");
  EXPECT_EQ(error("/api/behaviors/99999999999999999999", 404),
            "a behavior's id is a whole number");
  EXPECT_EQ(error("/api/behaviors/1/picture?t=nan", 503), "no pictures");
  EXPECT_EQ(error("/api/behaviors/1/message?topic=/t&t=nan", 400),
            "t should be a number of seconds");
  EXPECT_EQ(error("/api/behaviors?limit=many", 400), "limit should be a whole number");
  EXPECT_EQ(error("/api/behaviors?where=%7B", 400).find("\n"), std::string::npos);
  EXPECT_EQ(error("/api/compare?a=1", 400), "b is missing: a behavior's id");
  EXPECT_EQ(error("/console/../index.html", 404), "there is nothing at this address");
  EXPECT_EQ(error("/console/%2e%2e/index.html", 404), "there is nothing at this address");
  EXPECT_EQ(error("/api/events", 404), "no robot: this console reads a store");
}

HttpRequest request(const std::string& method, const std::string& path,
                    std::map<std::string, std::string> headers, const std::string& body = "") {
  HttpRequest made;
  made.method = method;
  made.path = path;
  made.headers = std::move(headers);
  made.body = body;
  return made;
}

TEST_F(Console, letsNobodyInWithoutTheToken) {
  EXPECT_EQ(send(request("GET", "/api/about", {}), kToken).status, 401);
  EXPECT_EQ(send(request("GET", "/api/about", {{"authorization", "Bearer 0123456789abcdeX"}}),
                 kToken).status,
            401);
  EXPECT_EQ(send(request("GET", "/api/about", {{"authorization", "Bearer 0123456789abcdef"}}),
                 kToken).status,
            200);
  EXPECT_EQ(send(request("GET", "/", {}), kToken).status, 200);
  const std::map<std::string, std::string> is_json = {{"content-type", "application/json"}};
  EXPECT_EQ(send(request("POST", "/api/login", is_json, R"({"token": "wrong"})"), kToken).status,
            401);
  EXPECT_EQ(send(request("POST", "/api/login", is_json, std::string(5000, '[')), kToken).status,
            400);
  const HttpResponse in =
      send(request("POST", "/api/login", is_json, R"({"token": "0123456789abcdef"})"), kToken);
  ASSERT_EQ(in.headers.size(), 1U);
  EXPECT_EQ(in.headers[0].second,
            "afterglow_token=0123456789abcdef; HttpOnly; SameSite=Strict; Path=/");
  const std::string cookies = "a=1; afterglow_token=0123456789abcdef";
  EXPECT_EQ(send(request("GET", "/api/about", {{"cookie", cookies}}), kToken).status, 200);
}

TEST_F(Console, refusesForeignSitesAndNames) {
  EXPECT_EQ(send(request("GET", "/", {{"host", "evil.example"}})).status, 403);
  EXPECT_EQ(send(request("GET", "/", {{"host", ""}})).status, 403);
  EXPECT_EQ(send(request("GET", "/", {{"host", "[::1]:8080"}})).status, 200);
  EXPECT_EQ(send(request("GET", "/", {{"host", "192.168.1.7"}})).status, 200);
  const auto post = [&](const std::string& origin, const std::string& type) {
    return send(request("POST", "/api/login", {{"origin", origin}, {"content-type", type}},
                        R"({"token": ""})"))
        .status;
  };
  EXPECT_EQ(post("http://evil.example", "application/json"), 403);
  EXPECT_EQ(post("null", "application/json"), 403);
  EXPECT_EQ(post("http://localhost:8080", "text/plain"), 415);
  EXPECT_EQ(post("http://localhost:8080", "application/json"), 200);
  EXPECT_EQ(send(request("DELETE", "/", {})).status, 405);
}

TEST(ConsoleTarget, isDecodedOnceAndStrictly) {
  HttpRequest made;
  readTarget("/a%2Fb+c?q=x+y%26z&&t=1&t=2#f", made);
  EXPECT_EQ(made.path, "/a/b+c");
  EXPECT_EQ(made.parameter("q"), "x y&z");
  EXPECT_EQ(made.parameter("t"), "2");
  for (const char* bad : {"", "x", "*", "/%", "/%4", "/%zz", "/a%00b", "/?q=%00"}) {
    EXPECT_THROW(readTarget(bad, made), HttpError) << bad;
  }
}

TEST(FoldedText, leavesCapitalsAndAccentsOut) {
  EXPECT_EQ(foldedText("\xc3\x89t\xc3\xa9 STRA\xc3\x9f" "E"), "ete strase");
  EXPECT_EQ(foldedText("e\xcc\x81 \xff!"), "e !");
  EXPECT_EQ(foldedText("\xd0\x96"), "\xd0\xb6");
}

TEST(StoryPairs, keepTheOrderOfBoth) {
  std::vector<StoryEntry> a(3), b(2);
  a[0].subject = "x";
  a[1].subject = "y";
  a[2].subject = "z";
  b[0].subject = "x";
  b[1].subject = "z";
  const auto pairs = pairStories(a, b);
  ASSERT_EQ(pairs.size(), 3U);
  EXPECT_EQ(pairs[0].b, 0U);
  EXPECT_FALSE(pairs[1].b);
  EXPECT_EQ(pairs[2].b, 1U);
}

/// A client that says what it is told to say.
class Client {
 public:
  explicit Client(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() { ::close(socket_); }

  void say(const std::string& text) const {
    ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL);
  }
  /// What comes next.
  std::string some() const {
    std::array<char, 4096> part{};
    const ssize_t size = ::recv(socket_, part.data(), part.size(), 0);
    return {part.data(), static_cast<std::size_t>(std::max<ssize_t>(0, size))};
  }
  /// All until the server closes the connection.
  std::string rest() const {
    std::string all;
    std::array<char, 4096> part{};
    for (;;) {
      const ssize_t size = ::recv(socket_, part.data(), part.size(), 0);
      if (size <= 0) return all;
      all.append(part.data(), static_cast<std::size_t>(size));
    }
  }

 private:
  int socket_;
};

void sayHello(const HttpRequest& request, const Respond& respond) {
  respond({200, "text/plain", "hello " + request.path});
}

std::string asked(std::uint16_t port, const std::string& text) {
  const Client client(port);
  client.say(text);
  return client.rest();
}

TEST(HttpServer, answersUntilItIsToldToClose) {
  const HttpServer server("127.0.0.1", 0, sayHello);
  const std::string answer = asked(server.port(),
                                   "GET /a HTTP/1.1\r\nHost: x\r\n\r\n"
                                   "GET /b HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  EXPECT_NE(answer.find("hello /a"), std::string::npos);
  EXPECT_NE(answer.find("hello /b"), std::string::npos);
  EXPECT_NE(answer.find("X-Content-Type-Options: nosniff"), std::string::npos);
}

TEST(HttpServer, boundsWhatItReads) {
  const HttpServer server("127.0.0.1", 0, sayHello);
  const auto status = [&](const std::string& text) {
    return asked(server.port(), text).substr(0, 12);
  };
  EXPECT_EQ(status("GET / HTTP/1.1\r\nHost: x\r\nA: " + std::string(100'000, 'a') + "\r\n\r\n"),
            "HTTP/1.1 431");
  EXPECT_EQ(status("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 9999999\r\n\r\n"),
            "HTTP/1.1 413");
  EXPECT_EQ(status("no HTTP at all\r\n\r\n"), "HTTP/1.1 400");
  EXPECT_EQ(status("GET / HTTP/1.1\r\nHost: x\r\nHost: y\r\nConnection: close\r\n\r\n"),
            "HTTP/1.1 400");
}

TEST(HttpServer, dropsWhoIsTooSlow) {
  HttpLimits limits;
  limits.header_patience = std::chrono::milliseconds(200);
  const HttpServer server("127.0.0.1", 0, sayHello, {}, limits);
  const Client slow(server.port());
  slow.say("GET / HTTP/1.1\r\nHost:");
  EXPECT_EQ(slow.rest(), "");
  limits.patience = limits.header_patience;
  const HttpServer hasty("127.0.0.1", 0, sayHello, {}, limits);
  const Client idle(hasty.port());
  EXPECT_EQ(idle.rest(), "");
}

const std::string kStop = "POST /stop HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n";

TEST(HttpServer, letsAStopInThoughSlowClientsHoldAllItsConnections) {
  HttpLimits limits;
  limits.connections = 4;
  limits.header_patience = limits.patience = std::chrono::seconds(600);
  const HttpServer server("127.0.0.1", 0, sayHello, {}, limits);
  std::vector<std::unique_ptr<Client>> slow;
  for (const char* begun : {"", "GET / HTTP/1.1\r\nHost:",
                            "POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n\r\n"}) {
    for (int i = 0; i < 8; ++i) {
      slow.push_back(std::make_unique<Client>(server.port()));
      slow.back()->say(begun);
    }
    EXPECT_NE(asked(server.port(), kStop).find("hello /stop"), std::string::npos) << begun;
  }
  EXPECT_EQ(slow.front()->rest(), "") << "the oldest had to go";
}

TEST(HttpServer, answersWhatIsUrgentThoughAllItsThreadsAreBusy) {
  std::promise<void> release;
  const std::shared_future<void> is_released = release.get_future().share();
  HttpLimits limits;
  limits.threads = 1;
  const HttpServer server(
      "127.0.0.1", 0,
      [&](const HttpRequest& request, const Respond& respond) {
        if (request.path == "/slow") is_released.wait();
        sayHello(request, respond);
      },
      [](const HttpRequest& request) { return request.path == "/stop"; }, limits);
  const Client slow(server.port()), next(server.port());
  for (const Client* client : {&slow, &next}) {
    client->say("GET /slow HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  }
  EXPECT_NE(asked(server.port(), kStop).find("hello /stop"), std::string::npos);
  release.set_value();
  EXPECT_NE(slow.rest().find("hello /slow"), std::string::npos);
  EXPECT_NE(next.rest().find("hello /slow"), std::string::npos);
}

TEST(HttpServer, leavesConnectionsToOthersThanPagesThatListen) {
  HttpLimits limits;
  limits.connections = 4;
  limits.streams = 2;
  std::atomic<int> listening{0};
  const HttpServer server(
      "127.0.0.1", 0,
      [&](const HttpRequest& request, const Respond& respond) {
        if (request.path != "/events") return sayHello(request, respond);
        HttpResponse response{200, "text/event-stream", ""};
        response.events = std::make_shared<EventStream>([&] { --listening; });
        ++listening;
        respond(std::move(response));
      },
      {}, limits);
  const std::string listen = "GET /events HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n";
  const Client one(server.port()), two(server.port());
  for (const Client* client : {&one, &two}) {
    client->say(listen);
    EXPECT_NE(client->some().find("200"), std::string::npos);
  }
  EXPECT_NE(asked(server.port(), listen).find("too many pages are open"), std::string::npos);
  EXPECT_NE(asked(server.port(), kStop).find("hello /stop"), std::string::npos);
  EXPECT_EQ(listening, 2);
}

TEST(HttpServer, saysWhyItCannotListen) {
  const HttpServer server("127.0.0.1", 0, sayHello);
  try {
    const HttpServer other("127.0.0.1", server.port(), sayHello);
    FAIL() << "it listens";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("Address already in use"), std::string::npos);
  }
  EXPECT_THROW(HttpServer("somewhere", 0, sayHello), std::runtime_error);
}

}  // namespace
}  // namespace afterglow::nodes::console_test
