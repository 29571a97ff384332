#include "afterglow/tree_watch.hpp"

#include <ros/ros.h>

#include <algorithm>
#include <map>
#include <stdexcept>

#include "replay/query/regular_expression.hpp"

namespace afterglow::nodes {
namespace {

/// A glob over paths as a regular expression.
std::string regexOf(const std::string& glob) {
  std::string text;
  for (std::size_t i = 0; i < glob.size(); ++i) {
    const bool is_double = glob.compare(i, 2, "**") == 0;
    if (is_double && glob.compare(i, 3, "**/") == 0 && (i == 0 || glob[i - 1] == '/')) {
      text += "(.*/)?";
      i += 2;
    } else if (is_double) {
      text += ".*";
      i += 1;
    } else if (glob[i] == '*') {
      text += "[^/]*";
    } else if (glob[i] == '?') {
      text += "[^/]";
    } else {
      text +=
          std::string(std::string("^$\\.+()[]{}|").find(glob[i]) == std::string::npos ? "" : "\\") +
          glob[i];
    }
  }
  return text;
}

replay::RegularExpression patternOf(const std::string& path) {
  try {
    return replay::RegularExpression(!path.empty() && path.front() == '^' ? path : regexOf(path));
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("'" + path + "' is no pattern of paths: " + error.what());
  }
}

std::string outcomeOf(const std::string& status) {
  return status == "SUCCESS" ? "success" : status == "FAILURE" ? "failure" : "halted";
}

}  // namespace

TransitionSink publishTransitions(const std::string& topic) {
  // "~" is the private name space of this node, which a plain handle does not resolve.
  const bool is_private = !topic.empty() && topic.front() == '~';
  ros::NodeHandle node(is_private ? "~" : "");
  const ros::Publisher publisher =
      node.advertise<TreeTransition>(is_private ? topic.substr(1) : topic, 1000);
  return [publisher](const TreeTransition& transition) { publisher.publish(transition); };
}

TreeWatch::TreeWatch(const std::vector<WatchedNode>& nodes, TreeWatchOptions options)
    : options_([&] {
        if (options.tree.empty() && !nodes.empty()) {
          options.tree = nodes.front().name;
        }
        if (!options.publish) {
          options.publish = publishTransitions();
        }
        return std::move(options);
      }()) {
  std::map<std::string, int> siblings;
  for (const WatchedNode& watched : nodes) {
    Node node;
    node.name = watched.name;
    node.type = watched.type;
    node.uid = watched.uid;
    node.parent = watched.parent;
    node.path = (watched.parent ? nodes_.at(*watched.parent).path + "/" : "") + watched.name;
    const int count = ++siblings[node.path];
    node.path += count > 1 ? "#" + std::to_string(count) : "";
    node.since = std::chrono::steady_clock::now();
    nodes_.push_back(std::move(node));
  }
  chooseNodes();
}

void TreeWatch::chooseNodes() {
  for (const RecordRule& rule : options_.record) {
    const replay::RegularExpression pattern = patternOf(rule.path);
    bool is_used = false;
    for (Node& node : nodes_) {
      if (pattern.isWhole(node.path)) {
        is_used = true;
        node.rule = node.rule ? node.rule : &rule;
      }
    }
    if (!is_used) {
      std::string known;
      for (const std::string& path : paths()) {
        known += "\n  " + path;
      }
      throw std::invalid_argument("no node of tree '" + options_.tree + "' matches '" + rule.path +
                                  "'; there are" + known);
    }
  }
}

std::vector<std::string> TreeWatch::paths() const {
  std::vector<std::string> paths;
  for (const Node& node : nodes_) {
    paths.push_back(node.path);
  }
  return paths;
}

void TreeWatch::onTransition(std::size_t index, const std::string& from, const std::string& to) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Node& node = nodes_.at(index);
  const bool is_over = to == "SUCCESS" || to == "FAILURE";
  if (!node.parent && from == "IDLE") {
    for (Node& any : nodes_) {
      any.failures = 0;
    }
  }
  // An action that never runs longer than one tick goes from IDLE to its result at once.
  if (node.rule && !node.recording && (to == "RUNNING" || is_over)) {
    begin(node, to == "RUNNING");
  }
  publish(index, from, to);
  if (node.recording && to != "RUNNING") {
    end(node, outcomeOf(to));
  }
  if (to == "FAILURE") {
    ++node.failures;
  } else if (to == "SUCCESS" || from == "RUNNING") {
    node.failures = 0;
  }
}

void TreeWatch::begin(Node& node, bool wait) {
  RecordingOptions recording = node.rule->recording;
  recording.name = recording.name.empty() ? node.name : recording.name;
  recording.tree_path = recording.tree_path.empty() ? node.path : recording.tree_path;
  recording.attempt = node.failures + 1;
  recording.wait = recording.wait && wait;
  recording.required = false;
  node.recording.emplace(std::move(recording), options_.recorder);
}

void TreeWatch::end(Node& node, const std::string& outcome) {
  const auto is_done = [](const BehaviorRecording& recording) { return recording.isDone(); };
  ending_.erase(std::remove_if(ending_.begin(), ending_.end(), is_done), ending_.end());
  node.recording->end(outcome);
  ending_.push_back(std::move(*node.recording));
  node.recording.reset();
}

std::int64_t TreeWatch::behaviorOf(std::size_t index) const {
  for (std::optional<std::size_t> at = index; at; at = nodes_[*at].parent) {
    if (nodes_[*at].recording) {
      return nodes_[*at].recording->id();
    }
  }
  return 0;
}

void TreeWatch::publish(std::size_t index, const std::string& from, const std::string& to) {
  Node& node = nodes_[index];
  const auto now = std::chrono::steady_clock::now();
  TreeTransition transition;
  transition.stamp = ros::Time::isValid() ? ros::Time::now() : ros::Time();
  transition.tree = options_.tree;
  transition.path = node.path;
  transition.type = node.type;
  transition.uid = node.uid;
  transition.from_status = from;
  transition.to_status = to;
  transition.duration = std::chrono::duration<double>(now - node.since).count();
  transition.attempt = node.failures + 1;
  transition.behavior_id = behaviorOf(index);
  node.since = now;
  options_.publish(transition);
}

}  // namespace afterglow::nodes
