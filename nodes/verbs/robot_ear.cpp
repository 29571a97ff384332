#include "nodes/verbs/robot_ear.hpp"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Header.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <boost/function.hpp>
#include <exception>
#include <memory>

#include "nodes/tools/callback_thread.hpp"
#include "nodes/tools/diagnostics.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"
#include "replay/motion/stops/operator_stops.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kNodePatience = 0.5;      // s
constexpr std::size_t kMostTopics = 100;   // that are listened to
constexpr std::size_t kMostFrames = 10000;  // of a tree, against those that make ever new ones
constexpr std::size_t kMostJoints = 1000;
constexpr std::size_t kMostBridges = 10;

const std::set<std::string>& typesWithHeader() {
  static const std::set<std::string> types = {"sensor_msgs/PointCloud2", "sensor_msgs/LaserScan",
                                              "nav_msgs/Path", "visualization_msgs/Marker",
                                              "nav_msgs/Odometry", "sensor_msgs/JointState"};
  return types;
}

std::string frameOf(const std::string& type, replay::Bytes& bytes) {
  ros::serialization::IStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  std_msgs::Header header;
  if (type == "visualization_msgs/MarkerArray") {
    std::uint32_t count = 0;
    stream.next(count);
    if (count == 0) return "";
  } else if (typesWithHeader().count(type) == 0) {
    return "";
  }
  stream.next(header);
  return header.frame_id.empty() || header.frame_id[0] != '/' ? header.frame_id
                                                              : header.frame_id.substr(1);
}

class Ear {
 public:
  Ear(RunningRobot& robot, const replay::RobotProfile::EmergencyStop& stop)
      : robot_(robot), stop_topic_(stop.topic), stop_(stop.field, stop.stops_when) {
    const boost::function<void(const tf2_msgs::TFMessageConstPtr&)> take =
        [this](const tf2_msgs::TFMessageConstPtr& message) { onTransforms(*message); };
    subscribers_.push_back(nh_.subscribe<tf2_msgs::TFMessage>("/tf", 100, take));
    subscribers_.push_back(nh_.subscribe<tf2_msgs::TFMessage>("/tf_static", 100, take));
    const boost::function<void(const diagnostic_msgs::DiagnosticArrayConstPtr&)> look =
        [this](const diagnostic_msgs::DiagnosticArrayConstPtr& array) { onDiagnostics(*array); };
    subscribers_.push_back(
        nh_.subscribe<diagnostic_msgs::DiagnosticArray>("/diagnostics", 100, look));
  }

  void listenTo(const std::string& topic) {
    if (robot_.heard.size() >= kMostTopics || robot_.heard.count(topic) > 0) return;
    robot_.heard[topic] = {};
    const boost::function<void(const AnyMessage&)> take = [this, topic](const AnyMessage& event) {
      onMessage(topic, *event.getConstMessage());
    };
    subscribers_.push_back(nh_.subscribe<topic_tools::ShapeShifter>(topic, 1, take));
  }

 private:
  void onMessage(const std::string& topic, const topic_tools::ShapeShifter& message) {
    HeardTopic& heard = robot_.heard[topic];
    ++heard.count;
    const bool is_read = topic == stop_topic_ || heard.count == 1 ||
                         message.getDataType() == "sensor_msgs/JointState";
    if (!is_read) return;
    try {
      replay::Bytes bytes = bytesOf(message);
      if (heard.frame.empty()) heard.frame = frameOf(message.getDataType(), bytes);
      if (message.getDataType() == "sensor_msgs/JointState") addJoints(heard, bytes);
      if (topic == stop_topic_) {
        heard.stops = stop_.stops(message.getDataType(), message.getMessageDefinition(), bytes);
      }
    } catch (const std::exception& error) {
      heard.problem = error.what();
    }
  }

  static void addJoints(HeardTopic& heard, replay::Bytes& bytes) {
    sensor_msgs::JointState state;
    ros::serialization::IStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
    stream.next(state);
    for (const std::string& name : state.name) {
      if (heard.joints.size() < kMostJoints) heard.joints.insert(name);
    }
  }

  void onDiagnostics(const diagnostic_msgs::DiagnosticArray& array) {
    for (const auto& status : array.status) {
      if (status.hardware_id != kBridgeHardware) continue;
      const bool is_known = robot_.bridges.count(status.name) > 0;
      if (is_known || robot_.bridges.size() < kMostBridges) robot_.bridges[status.name] = status;
    }
  }

  void onTransforms(const tf2_msgs::TFMessage& message) {
    const auto plain = [](const std::string& frame) {
      return frame.empty() || frame[0] != '/' ? frame : frame.substr(1);
    };
    for (const auto& transform : message.transforms) {
      if (robot_.parents.size() >= kMostFrames) return;
      robot_.parents[plain(transform.child_frame_id)] = plain(transform.header.frame_id);
    }
  }

  RunningRobot& robot_;
  const std::string stop_topic_;
  replay::StopField stop_;
  ros::NodeHandle nh_;
  std::vector<ros::Subscriber> subscribers_;
};

/// Up to the root, at most as many as there are: a circle has none.
std::string rootOf(const std::map<std::string, std::string>& parents, std::string frame) {
  for (std::size_t i = 0; i <= parents.size(); ++i) {
    const auto parent = parents.find(frame);
    if (parent == parents.end()) return frame;
    frame = parent->second;
  }
  return "";
}

}  // namespace

bool RunningRobot::hasFrame(const std::string& frame) const {
  return parents.count(frame) > 0 ||
         std::any_of(parents.begin(), parents.end(),
                     [&](const auto& entry) { return entry.second == frame; });
}

bool RunningRobot::areConnected(const std::string& frame, const std::string& other) const {
  if (!hasFrame(frame) || !hasFrame(other)) return false;
  const std::string root = rootOf(parents, frame);
  return !root.empty() && root == rootOf(parents, other);
}

std::vector<std::string> RunningRobot::publishedTopics(const std::string& type) const {
  std::vector<std::string> topics;
  for (const auto& [topic, of_type] : types) {
    const bool is_own = names.topic(topic) == topic;  // of several robots
    const bool is_sent = of_type == type && !graph.otherPublishers(topic).empty();
    if (is_own && is_sent) topics.push_back(topic);
  }
  return topics;
}

std::vector<std::string> topicsToHear(const replay::RobotProfile& robot) {
  std::vector<std::string> topics;
  for (const std::string& topic :
       {robot.scan_topic, robot.emergency_stop.topic, robot.base.odometry_topic}) {
    if (!topic.empty()) topics.push_back(topic);
  }
  return topics;
}

RunningRobot listenToRobot(const replay::RobotProfile& robot, std::vector<std::string> topics,
                           const std::vector<std::string>& nodes, double seconds) {
  RunningRobot running;
  running.seconds = seconds;
  running.names.name_space = rosNamespace();
  running.graph = askMaster(deadlineIn(kMasterPatience));
  running.types = askTopicTypes(deadlineIn(kMasterPatience));
  for (const std::string& topic : running.publishedTopics("sensor_msgs/JointState")) {
    topics.push_back(topic);
  }
  {
    Ear ear(running, robot.emergency_stop);
    for (const std::string& topic : topics) ear.listenTo(topic);
    const Deadline until = deadlineIn(seconds);
    while (std::chrono::steady_clock::now() < until && ros::ok() && !isStopRequested()) {
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.05));
    }
  }
  running.graph = askMaster(deadlineIn(kMasterPatience));
  running.controllers = askControllers(running.graph);
  for (const std::string& node : nodes) {
    if (isAlive(node, deadlineIn(kNodePatience))) running.living.insert(node);
  }
  const std::string& name_space = running.names.name_space;
  running.has_description = !robotParameter(name_space, "robot_description").empty();
  running.names =
      replay::findRobotNames(name_space, robotParameter(name_space, "tf_prefix"),
                             [&](const std::string& frame) { return running.hasFrame(frame); });
  return running;
}

}  // namespace afterglow::nodes
