/// \file
/// The decorator <RecordBehavior> for BehaviorTree.CPP, the same text for versions 3 and 4: include
/// behavior_tree_v3.hpp or behavior_tree_v4.hpp, never both in one program.
///
///     <RecordBehavior name="pick" topics="/gripper/command /tf" keep_if="failure,halted">
///       <SubTree ID="PickGearboxBottom"/>
///     </RecordBehavior>
///
/// The behavior is called as the decorator, or, without a name, as its child. Ports, all optional:
///   topics      names, separated by spaces, commas or semicolons
///   regexes     and topics that one of these matches as a whole; spaces or semicolons between
///   all         true: every topic
///   exclude     of regexes and all, none that one of these matches
///   limits      "/points max_hz=2; /scan every=5"; semicolons between
///   tree_path   place in the tree; empty: below the enclosing <RecordBehavior>, by name
///   parameters  a JSON object as it stands, or the blackboard entry {key} that holds one
///   tags        as topics
///   attempt     0 (default): counted, up with every failure
///   pre_roll    seconds to begin earlier
///   keep_if     outcomes to keep, e.g. "failure,halted"; empty: all
///   wait        false: the child need not wait for the recording to stand (default true)
///   timeout     seconds after which the child goes on without its recording (default 5)
///   required    true: FAILURE, child not ticked, if it cannot be recorded (default false)
///
/// It is RUNNING, without blocking, until the recording stands; then it is what its child is. The
/// recording ends once, as "success" or "failure", as "halted" after the child's halt, as "skipped"
/// (version 4), or as "exception", which goes on.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "afterglow/recorded_node.hpp"

namespace afterglow::nodes {

class RecordBehavior : public BT::DecoratorNode {
 public:
  RecordBehavior(const std::string& name, const BT::NodeConfiguration& config,
                 std::shared_ptr<RecorderClient> recorder)
      : BT::DecoratorNode(name, config), recorded_(std::move(recorder)) {}

  static BT::PortsList providedPorts() {
    const auto text = [](const char* port) { return BT::InputPort<std::string>(port, ""); };
    return {text("topics"),
            text("regexes"),
            BT::InputPort<bool>("all", "record every topic"),
            text("exclude"),
            text("limits"),
            text("tree_path"),
            text("parameters"),
            text("tags"),
            BT::InputPort<int>("attempt", "0: counted"),
            BT::InputPort<double>("pre_roll", "seconds"),
            text("keep_if"),
            BT::InputPort<bool>("wait", "until the recording stands"),
            BT::InputPort<double>("timeout", "seconds"),
            BT::InputPort<bool>("required", "no behavior without its recording")};
  }

  void halt() override {
    try {
      BT::DecoratorNode::halt();
    } catch (...) {
      recorded_.end("exception");
      throw;
    }
    recorded_.end("halted");
  }

 private:
  BT::NodeStatus tick() override {
    setStatus(BT::NodeStatus::RUNNING);
    if (!recorded_.isRunning()) {
      recorded_.begin(options());
    }
    if (!recorded_.mayGo()) {
      return BT::NodeStatus::RUNNING;
    }
    if (recorded_.isRefused()) {
      recorded_.end("unrecorded");
      return BT::NodeStatus::FAILURE;
    }
    const BT::NodeStatus status = tickChild();
    switch (status) {
      case BT::NodeStatus::RUNNING:
        break;
      case BT::NodeStatus::SUCCESS:
        recorded_.end("success");
        break;
      case BT::NodeStatus::FAILURE:
        recorded_.end("failure");
        break;
      default:
        recorded_.end("skipped");
    }
    return status;
  }

  BT::NodeStatus tickChild() {
    const EnclosingRecording enclosing(recorded_.running());
    try {
      return child()->executeTick();
    } catch (...) {
      recorded_.end("exception");
      throw;
    }
  }

  RecordingOptions options() const {
    RecordingOptions options;
    options.name = name() == registrationName() ? child_node_->name() : name();
    options.topics = words("topics", " \t\r\n,;");
    options.regexes = words("regexes", " \t\r\n;");
    options.all = input<bool>("all", options.all);
    options.exclude = words("exclude", " \t\r\n;");
    options.limits = words("limits", ";");
    options.tree_path = input<std::string>("tree_path", {});
    options.parameters = parameters();
    options.tags = words("tags", " \t\r\n,;");
    options.attempt = input<int>("attempt", 0);
    options.pre_roll_s = input<double>("pre_roll", options.pre_roll_s);
    options.keep_if = input<std::string>("keep_if", {});
    options.wait = input<bool>("wait", options.wait);
    options.timeout_s = input<double>("timeout", options.timeout_s);
    options.required = input<bool>("required", options.required);
    return options;
  }

  template <typename Value>
  Value input(const std::string& port, Value absent) const {
    if (config().input_ports.count(port) == 0) {
      return absent;
    }
    const auto value = getInput<Value>(port);
    if (!value) {
      throw BT::RuntimeError("RecordBehavior '", name(), "': ", value.error());
    }
    return value.value();
  }

  /// A JSON object in XML looks like a blackboard entry, but for its quotes.
  std::string parameters() const {
    const auto written = config().input_ports.find("parameters");
    if (written != config().input_ports.end() &&
        (written->second.find('"') != std::string::npos || written->second == "{}")) {
      return written->second;
    }
    return input<std::string>("parameters", {});
  }

  std::vector<std::string> words(const std::string& port, const std::string& separators) const {
    const std::string text = input<std::string>(port, {});
    const std::string blank = separators + " \t\r\n";
    std::vector<std::string> words;
    std::size_t begin = text.find_first_not_of(blank);
    while (begin != std::string::npos) {
      const std::size_t end = std::min(text.find_first_of(separators, begin), text.size());
      words.push_back(text.substr(begin, text.find_last_not_of(blank, end - 1) + 1 - begin));
      begin = text.find_first_not_of(blank, end);
    }
    return words;
  }

  RecordedNode recorded_;
};

/// Trees of this factory know <RecordBehavior> from now on.
inline void registerRecordBehavior(
    BT::BehaviorTreeFactory& factory,
    const std::shared_ptr<RecorderClient>& recorder = rosRecorder()) {
  factory.registerBuilder<RecordBehavior>(
      "RecordBehavior", [recorder](const std::string& name, const BT::NodeConfiguration& config) {
        return std::make_unique<RecordBehavior>(name, config, recorder);
      });
}

}  // namespace afterglow::nodes
