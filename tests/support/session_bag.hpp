/// \file
/// A bag as a recorder leaves it after two robots' session: several senders of a topic, latched
/// topics, types that are on no machine.
#pragma once

#include <geometry_msgs/Twist.h>
#include <ros/serialization.h>
#include <rosbag/bag.h>
#include <rosgraph_msgs/Log.h>
#include <tf2_msgs/TFMessage.h>
#include <topic_tools/shape_shifter.h>

#include <boost/make_shared.hpp>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <vector>

namespace afterglow::test {

/// Two waders walk through a pond for 12 s: 3859 messages on 9 topics.
class SessionBag {
 public:
  static constexpr std::int64_t kBegin = 1'750'000'000'123'456'789;
  static constexpr std::int64_t kLast = kBegin + 12'190'601'797;

  static void write(const std::string& path) {
    SessionBag session;
    session.addStart();
    for (int step = 0; step < kSteps; ++step) {
      session.addStep("wader1", step, 0);
      session.addStep("wader2", step, 300'000);
    }
    session.addCommands();
    rosbag::Bag bag(path, rosbag::bagmode::Write);
    bag.setChunkThreshold(100 * 1024);
    for (const auto& [ns, message] : session.messages_) message.write(bag, ns);
    bag.close();
  }

 private:
  static constexpr int kSteps = 600;
  static constexpr std::int64_t kMs = 1'000'000;

  struct Recorded {
    std::string topic, type, md5, definition, caller;
    bool is_latched;
    std::vector<std::uint8_t> bytes;

    void write(rosbag::Bag& bag, std::int64_t ns) const {
      topic_tools::ShapeShifter message;
      message.morph(md5, type, definition, is_latched ? "1" : "0");
      ros::serialization::IStream stream(const_cast<std::uint8_t*>(bytes.data()),
                                         static_cast<std::uint32_t>(bytes.size()));
      message.read(stream);
      const auto header = boost::make_shared<ros::M_string>();
      *header = {{"type", type},
                 {"md5sum", md5},
                 {"message_definition", definition},
                 {"callerid", caller},
                 {"latching", is_latched ? "1" : "0"}};
      ros::Time received;
      bag.write(topic, received.fromNSec(static_cast<std::uint64_t>(ns)), message, header);
    }
  };

  /// Of the fields of a message in their order, or of a whole message.
  template <typename... Fields>
  static std::vector<std::uint8_t> bytesOf(const Fields&... fields) {
    std::vector<std::uint8_t> bytes((ros::serialization::serializationLength(fields) + ...));
    ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
    (stream.next(fields), ...);
    return bytes;
  }

  template <typename Message>
  void add(std::int64_t after_ns, const std::string& topic, const std::string& caller,
           const Message& message, bool is_latched = false, std::string type = {}) {
    using namespace ros::message_traits;
    if (type.empty()) type = datatype(message);
    messages_[kBegin + after_ns] = {topic,  type,       md5sum(message),  definition(message),
                                    caller, is_latched, bytesOf(message)};
  }

  void addStart() {
    const char* callers[] = {"/record", "/pond", "/shore"};
    for (int i = 0; i < 7; ++i) {
      rosgraph_msgs::Log log;
      log.level = rosgraph_msgs::Log::INFO;
      log.name = callers[i % 3];
      log.msg = "line " + std::to_string(i) + " of \"" + log.name + "\": \xc3\xbc\n";
      log.topics = {"/rosout", "/tf_static"};
      add(30 * kMs * i, "/rosout", callers[i % 3], log, true);
    }
    tf2_msgs::TFMessage shore;
    shore.transforms.resize(1);
    shore.transforms[0].header.frame_id = "world";
    shore.transforms[0].child_frame_id = "shore";
    shore.transforms[0].transform.rotation.w = 1;
    add(201 * kMs, "/tf_static", "/shore", shore, true);
    addRipple(99 * kMs, "wader1");
  }

  /// Of a type that has arrays and texts.
  void addRipple(std::int64_t after_ns, const std::string& robot) {
    std::vector<float> heights(random_() % 6);
    for (float& height : heights) height = static_cast<float>(random_()) * 1e-9f;
    const auto strength = static_cast<std::uint8_t>(random_());
    messages_[kBegin + after_ns] = {"/" + robot + "/ripple",
                                    "pond/Ripple",
                                    "4af647ec42edb630c6e657a0fe55bde9",
                                    "uint8 strength\nstring source\nfloat32[] heights\n",
                                    "/pond",
                                    false,
                                    bytesOf(strength, robot, heights)};
  }

  void addPose(std::int64_t after_ns, const std::string& robot, double x, double y) {
    ros::Time measured;
    measured.fromNSec(static_cast<std::uint64_t>(kBegin + after_ns - kMs));
    messages_[kBegin + after_ns] = {
        "/" + robot + "/pose",
        "pond/Pose",
        "4f6a7a9d11321aeb168eb99bb578a1be",
        "# Where a wader stands.\nfloat64 x\nfloat64 y\nfloat32 heading\ntime measured\n",
        "/pond",
        false,
        bytesOf(x, y, static_cast<float>(x - y), measured)};
  }

  void addStep(const std::string& robot, int step, std::int64_t later_ns) {
    const std::int64_t after_ns = 210 * kMs + step * (20 * kMs + 3) + later_ns;
    const double x = 0.01 * step + static_cast<double>(random_()) * 1e-12;
    const double y = std::sin(x) + static_cast<double>(later_ns) * 1e-6;
    addRipple(after_ns + 100'000, robot);
    addPose(after_ns + 200'000, robot, x, y);
    tf2_msgs::TFMessage tf;
    tf.transforms.resize(1);
    tf.transforms[0].header.frame_id = "world";
    tf.transforms[0].header.seq = static_cast<std::uint32_t>(step);
    tf.transforms[0].child_frame_id = robot;
    tf.transforms[0].transform.translation.x = x;
    tf.transforms[0].transform.translation.y = y;
    tf.transforms[0].transform.rotation.w = 1;
    add(after_ns + 300'000, "/tf", "/" + robot + "_broadcaster", tf, false, "tf/tfMessage");
  }

  /// The first one is fastest, 1.5 m/s, after 6.5 s.
  void addCommands() {
    for (int i = 0; i < 150; ++i) {
      geometry_msgs::Twist twist;
      twist.linear.x = i <= 100 ? 0.25 + 0.0125 * i : 1.5 - 0.03 * (i - 100);
      twist.angular.z = 0.3 * std::sin(0.1 * i);
      add((1500 + 50 * i) * kMs, "/wader1/cmd_vel", "/whistle", twist);
    }
    for (int i = 0; i < 100; ++i) {
      geometry_msgs::Twist twist;
      twist.linear.x = 1.2;
      add((943 + 100 * i) * kMs, "/wader2/cmd_vel", "/whistle", twist);
    }
  }

  std::mt19937 random_{11};
  std::map<std::int64_t, Recorded> messages_;  ///< by stamp
};

}  // namespace afterglow::test
