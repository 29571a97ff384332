/// \file
/// The decorator `<RecordBehavior>` for BehaviorTree.CPP, the same text for versions 3 and 4:
/// include behavior_tree_v3.hpp or behavior_tree_v4.hpp, never both in one program.
///
///     <RecordBehavior name="pick" topics="/gripper/command /tf" keep_if="failure,halted">
///       <SubTree ID="PickGearboxBottom"/>
///     </RecordBehavior>
///
/// The behavior is called as the decorator, or, without a name, as its child. Ports, all optional,
/// are what a recording can be asked for: visitRecordingFields() (recorder_client.hpp) explains
/// them and what may stand between the words of a list. `parameters` is a JSON object as it stands,
/// or the blackboard entry {key} that holds one; `attempt` counts up with every failure unless it
/// is given. Beside them:
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
#include <type_traits>
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
    BT::PortsList ports = {
        BT::InputPort<bool>("wait", "until the recording stands"),
        BT::InputPort<double>("timeout", "seconds"),
        BT::InputPort<bool>("required", "no behavior without its recording")};
    visitRecordingFields(
        [&ports](const RecordingField& field, const auto& value) {
          using Value = std::decay_t<decltype(value)>;
          using Port = std::conditional_t<std::is_arithmetic<Value>::value, Value, std::string>;
          if (field.name == std::string("name")) return;  // the node's
          ports.insert(BT::InputPort<Port>(field.name, field.help));
        },
        RecordingOptions());
    return ports;
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

  /// A field from its port.
  struct ReadPort {
    const RecordBehavior& node;

    void operator()(const RecordingField& field, std::vector<std::string>& words) const {
      words = node.words(field.name, field.separators);
    }
    void operator()(const RecordingField& field, std::string& text) const {
      const std::string port = field.name;
      if (port != "name") text = port == "parameters" ? node.parameters() : node.text(port);
    }
    template <typename Number>
    void operator()(const RecordingField& field, Number& number) const {
      number = node.input<Number>(field.name, number);
    }
  };

  RecordingOptions options() const {
    RecordingOptions options;
    options.attempt = 0;
    visitRecordingFields(ReadPort{*this}, options);
    options.name = name() == registrationName() ? child_node_->name() : name();
    options.wait = input<bool>("wait", options.wait);
    options.timeout_s = input<double>("timeout", options.timeout_s);
    options.required = input<bool>("required", options.required);
    return options;
  }

  std::string text(const std::string& port) const { return input<std::string>(port, {}); }

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
    return text("parameters");
  }

  std::vector<std::string> words(const std::string& port, const std::string& separators) const {
    const std::string text = this->text(port);
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

/// Trees of this factory know `<RecordBehavior>` from now on.
inline void registerRecordBehavior(
    BT::BehaviorTreeFactory& factory,
    const std::shared_ptr<RecorderClient>& recorder = rosRecorder()) {
  factory.registerBuilder<RecordBehavior>(
      "RecordBehavior", [recorder](const std::string& name, const BT::NodeConfiguration& config) {
        return std::make_unique<RecordBehavior>(name, config, recorder);
      });
}

}  // namespace afterglow::nodes
