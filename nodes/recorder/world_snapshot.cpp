#include "nodes/recorder/world_snapshot.hpp"

#include <ros/serialization.h>
#include <tf2/exceptions.h>

#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>

#include "calib/file_replacement.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/plan/recorded_drivers.hpp"
#include "replay/store/checksum.hpp"

namespace afterglow::nodes {
namespace {

nlohmann::json toJson(const sensor_msgs::CameraInfo& info) {
  return {{"frame_id", info.header.frame_id},
          {"width", info.width},
          {"height", info.height},
          {"distortion_model", info.distortion_model},
          {"D", info.D},
          {"K", std::vector<double>(info.K.begin(), info.K.end())},
          {"R", std::vector<double>(info.R.begin(), info.R.end())},
          {"P", std::vector<double>(info.P.begin(), info.P.end())}};
}

}  // namespace

WorldSnapshot::WorldSnapshot(const RecorderNodeOptions& options, replay::Store& store)
    : options_(options), store_(store) {
  if (!options_.map_topic.empty()) {
    map_subscriber_ = node_.subscribe<nav_msgs::OccupancyGrid>(
        options_.map_topic, 1, [this](const nav_msgs::OccupancyGridConstPtr& map) {
          std::string identity = mapIdentity(*map);
          const std::lock_guard<std::mutex> lock(mutex_);
          map_ = std::move(identity);
        });
  }
  if (options_.camera_info.empty()) {
    return;
  }
  camera_info_subscriber_ = node_.subscribe<sensor_msgs::CameraInfo>(
      options_.camera_info, 1, [this](const sensor_msgs::CameraInfoConstPtr& info) {
        const std::lock_guard<std::mutex> lock(mutex_);
        camera_info_ = *info;
      });
}

replay::RobotNames WorldSnapshot::robot() const {
  const std::string name_space = rosNamespace();
  return replay::findRobotNames(
      name_space, robotParameter(name_space, "tf_prefix"),
      [this](const std::string& frame) { return buffer_._frameExists(frame); });
}

replay::Snapshot::Frames WorldSnapshot::frames() const {
  const replay::RobotNames robot = this->robot();
  replay::Snapshot::Frames frames;
  for (std::size_t i = 1; i < options_.anchors.size(); ++i) {
    const std::string from = robot.frame(options_.anchors[i - 1]);
    const std::string to = robot.frame(options_.anchors[i]);
    try {
      const auto transform = buffer_.lookupTransform(from, to, ros::Time(0)).transform;
      frames[from + "->" + to] = {transform.translation.x, transform.translation.y,
                                  transform.translation.z, transform.rotation.x,
                                  transform.rotation.y,    transform.rotation.z,
                                  transform.rotation.w};
    } catch (const tf2::TransformException&) {
      // Not connected: this robot has no such frame, or not yet.
    }
  }
  return frames;
}

std::string WorldSnapshot::urdf() {
  const std::string text = robotParameter(rosNamespace(), "robot_description");
  if (text.empty()) return {};
  const std::lock_guard<std::mutex> lock(mutex_);
  if (text != urdf_text_) {
    const replay::Bytes bytes(text.begin(), text.end());
    const std::string hash = replay::sha256(bytes);
    store_.addFile(hash, bytes);
    urdf_text_ = text;
    urdf_sha256_ = hash;
  }
  return urdf_sha256_;
}

std::string WorldSnapshot::map() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return map_;
}

std::string WorldSnapshot::calibration() const {
  nlohmann::json json = nlohmann::json::object();
  if (!options_.calibration.empty()) {
    for (const std::string name : {"projector.yaml", "T_camera_projector.yaml"}) {
      std::ifstream file = calib::openRegularFile(options_.calibration + "/" + name);
      const std::string text{std::istreambuf_iterator<char>(file), {}};
      if (!text.empty()) json[name] = text;
    }
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (camera_info_) {
    json["camera_info"] = toJson(*camera_info_);
  }
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

namespace {

constexpr double kPatience = 1;  // s, for each of two questions

/// "/arm/status" for "/arm/goal": who tells of an action serves it.
std::set<std::string> withStatus(const std::vector<std::string>& topics) {
  std::set<std::string> all(topics.begin(), topics.end());
  for (const std::string& topic : topics) {
    const std::string action = replay::actionOfGoal(topic);
    if (!action.empty()) all.insert(action + "/status");
  }
  return all;
}

}  // namespace

replay::RecordedNodes nodesNow(const std::vector<std::string>& topics) {
  replay::RecordedNodes nodes;
  try {
    const RosGraph graph = askMaster(deadlineIn(kPatience));
    const std::map<std::string, std::string> types = askTopicTypes(deadlineIn(kPatience));
    std::set<std::string> noted = withStatus(topics);
    for (const auto& [topic, type] : types) {
      if (replay::tellsWhoDrove(type)) noted.insert(topic);
    }
    for (const std::string& topic : noted) {
      const auto type = types.find(topic);
      const replay::TopicNodes around{type == types.end() ? "" : type->second,
                                      graph.otherPublishers(topic), graph.otherSubscribers(topic)};
      if (!around.publishers.empty() || !around.subscribers.empty()) nodes[topic] = around;
    }
  } catch (const std::runtime_error&) {  // a recording goes on without its master
    nodes.clear();
  }
  return nodes;
}

std::string mapIdentity(const nav_msgs::OccupancyGrid& map) {
  nav_msgs::MapMetaData info = map.info;
  info.map_load_time = ros::Time();
  replay::Bytes bytes(ros::serialization::serializationLength(info));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, info);
  bytes.insert(bytes.end(), map.data.begin(), map.data.end());
  return replay::sha256(bytes);
}

}  // namespace afterglow::nodes
