#include "nodes/recorder/recorder_options.hpp"

#include <stdexcept>

#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

template <class Value>
void read(const ros::NodeHandle& node, const std::string& name, Value& value,
          const std::string& kind) {
  if (node.hasParam(name) && !node.getParam(name, value)) {
    throw std::runtime_error("~" + name + " must be " + kind);
  }
}

template <class Number>
void readAtLeast(const ros::NodeHandle& node, const std::string& name, Number& value,
                 Number least) {
  read(node, name, value, "a number");
  if (!(value >= least)) {
    throw std::runtime_error("~" + name + " must be at least " + std::to_string(least));
  }
}

}  // namespace

RecorderNodeOptions RecorderNodeOptions::read(const ros::NodeHandle& node) {
  RecorderNodeOptions options;
  const std::string topics = "a list of topic names";
  nodes::read(node, "store", options.store, "a text");
  refuseStorePassword(node, options.store);
  nodes::read(node, "robot", options.robot, "a text");
  nodes::read(node, "context_topics", options.context_topics, topics);
  readAtLeast(node, "connect_timeout", options.connect_timeout_s, 0.0);
  readAtLeast(node, "rescan", options.rescan_s, 0.01);
  readAtLeast(node, "queue_megabytes", options.queue_megabytes, 1);
  readAtLeast(node, "pre_roll", options.pre_roll_s, 0.0);
  readAtLeast(node, "pre_roll_megabytes", options.pre_roll_megabytes, 1);
  nodes::read(node, "pre_roll_topics", options.pre_roll_topics, topics);
  readAtLeast(node, "min_space", options.min_space_megabytes, 0);
  nodes::read(node, "anchors", options.anchors, "a list of frames");
  nodes::read(node, "calibration", options.calibration, "a folder");
  nodes::read(node, "file_roots", options.file_roots, "a list of folders");
  nodes::read(node, "camera_info", options.camera_info, "a topic");
  nodes::read(node, "map_topic", options.map_topic, "a topic");
  readAtLeast(node, "retention_days", options.retention_days, 0.0);
  readAtLeast(node, "retention_gigabytes", options.retention_gigabytes, 0.0);
  nodes::read(node, "keep_tags", options.keep_tags, "a list of tags");
  nodes::read(node, "mongodb_logger", options.mongodb_logger, "true or false");
  return options;
}

RecorderNodeOptions RecorderNodeOptions::resolved() const {
  RecorderNodeOptions options = *this;
  const auto resolve = [](std::string& topic) {
    if (!topic.empty()) topic = ros::names::resolve(topic);
  };
  for (std::string& topic : options.context_topics) resolve(topic);
  for (std::string& topic : options.pre_roll_topics) resolve(topic);
  resolve(options.camera_info);
  resolve(options.map_topic);
  return options;
}

}  // namespace afterglow::nodes
