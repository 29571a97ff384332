/// \file
/// A small store and what every store must find in it.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "replay/messages/document.hpp"
#include "replay/store/store.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::test {

inline replay::Channel twistChannelAt(const std::string& topic) {
  return {topic,
          "geometry_msgs/Twist",
          "9f195f881246fdfa2798d1d3eebca84a",
          "Vector3 linear\nVector3 angular\n"
          "================================================================================\n"
          "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n",
          false,
          "/driver"};
}

/// Things seen, in an array; numbers in an array; a time; an integer that no double holds.
inline replay::Channel thingsChannel() {
  return {"/things",
          "test/Things",
          std::string(32, '7'),
          "Thing[] things\nint32[] counts\ntime stamp\nuint64 big\nbool done\n"
          "================================================================================\n"
          "MSG: test/Thing\nstring name\nfloat32 weight\n",
          false,
          "/eyes"};
}

/// Writes behaviors and their messages, second by second.
class QueryStore {
 public:
  explicit QueryStore(replay::Store& store)
      : store_(store), recording_(store.addRecording({0, "", "queries", "fetch7"})) {}

  void fill() {
    begin("pick red", "success", 1);
    speeds({0.1, 0.2, 0.3});
    say({"picking the red cube", "done"});
    things({{"red cube", 0.25F}, {"tray", 1.5F}}, {1, 2, 3}, false);
    end({{"parameters", R"({"object": "red cube", "tries": 1, "pose": {"x": 0.5}})"}}, {"demo"});
    begin("pick blue", "failure", 2);
    speeds({0.1, 0.9, -0.4});
    say({"picking the blue cube", "Sorry, it slipped"});
    things({{"blue cube", 0.25F}}, {4}, true);
    end({{"parameters", R"({"object": "blue cube", "tries": 3, "weights": [0.1, 0.9]})"}},
        {"demo", "grasp"});
    begin("place", "success", 1);
    speeds({0.0, 0.0});
    say({"done"});
    things({}, {}, true);
    end({{"parameters", R"({"object": null})"}, {"robot", "fetch8"}}, {});
    begin("drive", "stopped", 1);
    speeds({0.5, HUGE_VAL, std::nan("")});
    end({}, {"grün"});
    begin("look", "success", 1);
    std::vector<std::pair<std::string, float>> many(70, {"crumb", 0.001F});
    things(many, std::vector<std::int32_t>(65, 9), false);
    say({"I see \xff crumbs"});  // no UTF-8
    end({{"parameters", R"({"object": ["a", "b"]})"}}, {"demo"});
  }

 private:
  void begin(const std::string& name, const std::string& outcome, int attempt) {
    behavior_ = {};
    behavior_.recording = recording_;
    behavior_.name = name;
    behavior_.outcome = outcome;
    behavior_.attempt = attempt;
    behavior_.robot = "fetch7";
    behavior_.topics = {"/cmd_vel", "/said", "/things"};
    behavior_.begin = {now_ns_};
  }

  void end(const std::vector<std::pair<std::string, std::string>>& fields,
           std::vector<std::string> tags) {
    for (const auto& [name, value] : fields) {
      (name == "robot" ? behavior_.robot : behavior_.parameters) = value;
    }
    behavior_.tags = std::move(tags);
    behavior_.end = replay::Stamp{now_ns_};
    store_.addBehavior(behavior_);
    now_ns_ += 1'000'000'000;
  }

  void append(const replay::Channel& channel, const replay::Bytes& bytes) {
    store_.append({{store_.addChannel(recording_, channel), replay::Stamp{now_ns_}, ++sequence_,
                    replay::Stamp{7}, bytes}});
    now_ns_ += 1'000'000'000;
  }

  void speeds(const std::vector<double>& values) {
    for (const double x : values) {
      replay::Bytes bytes(48, 0);
      std::memcpy(bytes.data(), &x, sizeof(x));
      append(twistChannelAt("/cmd_vel"), bytes);
    }
  }

  void say(const std::vector<std::string>& texts) {
    for (const std::string& text : texts) append(stringChannel("/said"), stringBytes(text));
  }

  void things(const std::vector<std::pair<std::string, float>>& seen,
              const std::vector<std::int32_t>& counts, bool is_done) {
    const replay::Channel channel = thingsChannel();
    replay::Array array;
    for (const auto& [name, weight] : seen) {
      array.push_back(replay::Object{{"name", name}, {"weight", weight}});
    }
    replay::NumberArray numbers{replay::FieldType::Int32,
                                replay::Bytes(counts.size() * sizeof(std::int32_t))};
    if (!counts.empty()) std::memcpy(numbers.bytes.data(), counts.data(), numbers.bytes.size());
    const auto done = static_cast<std::uint8_t>(is_done ? 1 : 0);
    append(channel, replay::encode(replay::Schema::parse(channel.type, channel.definition),
                                   replay::Object{{"things", array},
                                                  {"counts", numbers},
                                                  {"stamp", replay::RosTime{1'600'000'000, 5}},
                                                  {"big", (std::uint64_t{1} << 53) + 1},
                                                  {"done", replay::BoolByte{done}}}));
  }

  replay::Store& store_;
  std::int64_t recording_;
  std::int64_t now_ns_ = 1'000'000'000;
  std::uint64_t sequence_ = 0;
  replay::Behavior behavior_;
};

inline void fillQueryStore(replay::Store& store) { QueryStore(store).fill(); }

/// A filter over behaviors and the names it finds, newest first.
struct QueryCase {
  const char* filter;
  std::vector<std::string> names;
};

inline const std::vector<QueryCase>& queryCases() {
  using Names = std::vector<std::string>;
  const Names all = {"look", "drive", "place", "pick blue", "pick red"};
  static const std::vector<QueryCase> cases = {
      {R"({})", all},
      // a behavior's own fields
      {R"({"name": "place"})", {"place"}},
      {R"({"name": {"$regex": "^pick"}})", {"pick blue", "pick red"}},
      {R"({"name": {"$regex": "^PICK", "$options": "i"}, "outcome": "failure"})", {"pick blue"}},
      {R"({"outcome": {"$ne": "success"}})", {"drive", "pick blue"}},
      {R"({"outcome": {"$in": ["failure", "stopped"]}})", {"drive", "pick blue"}},
      {R"({"outcome": {"$nin": ["failure", "stopped"]}})", {"look", "place", "pick red"}},
      {R"({"attempt": {"$gte": 2}})", {"pick blue"}},
      {R"({"robot": "fetch8"})", {"place"}},
      {R"({"tags": "demo"})", {"look", "pick blue", "pick red"}},
      {R"({"tags": ["demo"]})", {"look", "pick red"}},
      {R"({"tags": "grün"})", {"drive"}},
      {R"({"tags.1": "grasp"})", {"pick blue"}},
      {R"({"tags": {"$exists": true}, "tags.0": {"$exists": false}})", {"place"}},
      {R"({"parameters.tries": {"$gt": 1}})", {"pick blue"}},
      {R"({"parameters.object": null})", {"drive", "place"}},
      {R"({"parameters.object": {"$exists": false}})", {"drive"}},
      {R"({"parameters.object": "b"})", {"look"}},
      {R"({"parameters.pose": {"x": 0.5}})", {"pick red"}},
      {R"({"parameters.weights": {"$elemMatch": {"$gt": 0.2, "$lt": 0.8}}})", {}},
      {R"({"parameters.weights": {"$gt": 0.2, "$lt": 0.8}})", {"pick blue"}},
      {R"({"duration_s": {"$gt": 5.5}})", {"pick blue", "pick red"}},
      {R"({"begin": 1000000000})", {"pick red"}},
      {R"({"begin": {"$lt": "1970-01-01T00:00:02Z"}})", {"pick red"}},
      {R"({"begin": {"$gt": "2001-01-01"}})", {}},
      {R"({"$or": [{"name": "look"}, {"attempt": 2}]})", {"look", "pick blue"}},
      {R"({"$nor": [{"name": "look"}, {"attempt": 2}]})", {"drive", "place", "pick red"}},
      {R"({"$not": {"name": "look"}, "outcome": "success"})", {"place", "pick red"}},
      // messages
      {R"({"/cmd_vel": {"linear.x": {"$gt": 0.5}}})", {"drive", "pick blue"}},
      {R"({"/cmd_vel": {"linear.x": {"$lt": 0}}})", {"pick blue"}},
      {R"({"/cmd_vel": {"linear.x": 0.2}})", {"pick red"}},
      {R"({"/cmd_vel": {"linear.x": {"$gt": 0.25, "$lt": 0.6}}})", {"drive", "pick red"}},
      {R"({"/cmd_vel": {"linear.x": "nan"}})", {"drive"}},
      {R"({"/cmd_vel": {"linear.x": "inf"}})", {"drive"}},
      {R"({"/cmd_vel": {"linear.x": {"$ne": 0}}})", {"drive", "pick blue", "pick red"}},
      {R"({"/cmd_vel": {"linear.x": {"$not": {"$lte": 0.5}}}})", {"drive", "pick blue"}},
      {R"({"$not": {"/cmd_vel": {"linear.x": {"$gt": 0.25}}}})", {"look", "place"}},
      {R"({"/cmd_vel": {"linear": {"x": 0.2, "y": 0.0, "z": 0.0}}})", {"pick red"}},
      {R"({"/cmd_vel": {"linear.w": {"$exists": true}}})", {}},
      {R"({"/cmd_vel": {"linear.w": {"$exists": false}}})",
       {"drive", "place", "pick blue", "pick red"}},
      {R"({"/cmd_vel": {"$exists": false}})", {"look"}},
      {R"({"/cmd_vel": {}, "/said": {"$exists": false}})", {"drive"}},
      {R"({"/said": {"data": "done"}})", {"place", "pick red"}},
      {R"({"/said": {"data": {"$regex": "^sorry", "$options": "i"}}})", {"pick blue"}},
      {R"({"/said": {"data": {"$gte": "picking the r"}}})", {"pick red"}},
      {R"({"/said": {"data": {"$in": ["done", "Sorry, it slipped"]}}})",
       {"place", "pick blue", "pick red"}},
      {R"({"/said": {"data": {"$nin": ["done"]}}})", {"look", "pick blue", "pick red"}},
      {"{\"/said\": {\"data\": \"I see \xEF\xBF\xBD crumbs\"}}", {"look"}},
      {R"({"/said": {"data": 5}})", {}},
      {R"({"/said": {"data": "done"}, "/cmd_vel": {"linear.x": 0.3}})", {"pick red"}},
      {R"({"$or": [{"/said": {"data": "done"}}, {"/cmd_vel": {"linear.x": 0.5}}]})",
       {"drive", "place", "pick red"}},
      {R"({"/things": {"things.name": "tray"}})", {"pick red"}},
      {R"({"/things": {"things.0.name": "tray"}})", {}},
      {R"({"/things": {"things.1.name": "tray"}})", {"pick red"}},
      {R"({"/things": {"things": {"$elemMatch": {"name": "tray", "weight": {"$lt": 1}}}}})", {}},
      {R"({"/things": {"things": {"$elemMatch": {"name": "tray", "weight": 1.5}}}})", {"pick red"}},
      {R"({"/things": {"things": []}})", {"place"}},
      {R"({"/things": {"things.count": {"$gt": 64}}})", {"look"}},
      {R"({"/things": {"things.name": "crumb"}})", {}},
      {R"({"/things": {"counts": 2}})", {"pick red"}},
      {R"({"/things": {"counts": [1, 2, 3]}})", {"pick red"}},
      {R"({"/things": {"counts.count": 65, "counts.type": "int32"}})", {"look"}},
      {R"({"/things": {"done": true}})", {"place", "pick blue"}},
      {R"({"/things": {"done": 1}})", {}},
      {R"({"/things": {"stamp.secs": 1600000000, "name": "x"}})", {}},
      {R"({"/things": {"stamp.nsecs": 5, "counts": 4}})", {"pick blue"}},
      {R"({"/things": {"big": 9007199254740993, "counts": 4}})", {"pick blue"}},
      {R"({"/things": {"big": 9007199254740992}})", {}},
      {R"({"/said": {"_meta.stamp_ns": {"$lt": 6000000000}}})", {"pick red"}},
      {R"({"/said": {"_meta.header_stamp_ns": 7, "data": "done"}})", {"place", "pick red"}},
      {R"({"/unheard": {"data": 1}})", {}},
  };
  return cases;
}

/// A filter over the messages of "pick blue" and which of them it leaves.
struct MessageCase {
  const char* topic;
  const char* filter;
  std::size_t count;
};

inline const std::vector<MessageCase>& messageCases() {
  static const std::vector<MessageCase> cases = {
      {"/cmd_vel", R"({"linear.x": {"$gt": 0}})", 2},  {"/cmd_vel", R"({"linear.x": 7})", 0},
      {"/said", R"({"data": {"$regex": "cube"}})", 1}, {"/said", R"({})", 2},
      {"/things", R"({"things.weight": 0.25})", 1},
  };
  return cases;
}

}  // namespace afterglow::test
