#include "nodes/player/stop_inputs.hpp"

#include <utility>

#include "replay/messages/ranges.hpp"

namespace afterglow::nodes {

std::string baseTopic(const replay::PlayPlan& plan, const std::string& named,
                      const std::string& of_profile) {
  std::vector<std::string> topics;
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (!topic.isPlayed() || !isVelocity(topic.channel)) continue;
    if (!named.empty() && topic.judged() == named) return topic.output.topic;
    topics.push_back(topic.output.topic);
  }
  for (const std::string& known : {named, of_profile}) {
    if (replay::contains(topics, known)) return known;
  }
  return topics.size() == 1 ? topics.front() : "";
}

StopInputs::StopInputs(const StopOptions& options, TakeOver& take_over, Actions actions)
    : options_(options), take_over_(take_over), actions_(std::move(actions)) {
  if (!options_.emergency_stop.topic.empty()) {
    emergency_stop_.emplace(options_.emergency_stop, actions_.stop);
  }
  if (!options_.hold_button.topic.empty()) {
    hold_button_.emplace(options_.hold_button,
                         [this](bool is_held) { actions_.halt(!is_held); });
  }
}

StopInputs::~StopInputs() { take_over_.end(); }

void StopInputs::check() {
  if (emergency_stop_) emergency_stop_->check();
  take_over_.begin(actions_.stop);
}

void StopInputs::waitUntilHeld(const std::function<bool()>& is_stopped) {
  if (hold_button_) hold_button_->waitUntilHeld(is_stopped);
}

std::vector<std::string> StopInputs::notes() const {
  const EmergencyStopOptions& stop = options_.emergency_stop;
  if (stop.topic.empty() || stop.profile.empty()) return {};
  return {"the emergency stop that was obeyed is " + stop.text() + ", as the profile " +
          stop.profile + " has it"};
}

}  // namespace afterglow::nodes
