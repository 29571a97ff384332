#include "nodes/player/hold_button.hpp"

#include <fmt/format.h>

#include <charconv>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "nodes/tools/ros_graph.hpp"
#include "replay/clock/steady_time.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/plan/refusal_text.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kHoldLook = 0.01;  // s, for silence

}  // namespace

void HoldButtonOptions::set(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const bool has_both = colon != std::string::npos && text.front() == '/';
  const char* const begin = text.data() + (has_both ? colon + 1 : 0);
  const char* const end = text.data() + text.size();
  std::size_t number = 0;
  const auto [rest, error] = std::from_chars(begin, end, number);
  if (!has_both || error != std::errc() || rest != end) {
    throw std::invalid_argument("'" + text + "' is no /TOPIC:BUTTON, such as /joy:10");
  }
  topic = replay::TopicName(text.substr(0, colon)).text();
  button = number;
}

HoldButton::HoldButton(const HoldButtonOptions& options, std::function<void(bool)> on_change)
    : options_(options),
      named_(fmt::format("button {} of {}", options.button, options.topic)),
      on_change_(std::move(on_change)) {
  // Not the latest alone: a short release must not be lost.
  thread_.hear<Event>(options_.topic, 20, [this](const Event& event) { onJoy(event); });
  thread_.every(kHoldLook, [this] { tellChange(); });
  thread_.begin();
}

/// Hears the joystick; the replay's own messages hold nothing.
void HoldButton::onJoy(const Event& event) {
  if (event.getPublisherName() == ros::this_node::getName()) return;
  const sensor_msgs::Joy& joy = *event.getMessage();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    has_button_ = options_.button < joy.buttons.size();
    hold_.heard(replay::sinceBoot(), has_button_ && joy.buttons[options_.button] != 0);
  }
  tellChange();
}

void HoldButton::tellChange() {
  bool is_held = false, is_silent = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_held = hold_.isHeld(replay::sinceBoot());
    is_silent = hold_.hasFallenSilent(replay::sinceBoot());
    if (std::exchange(was_held_, is_held) == is_held) return;
  }
  on_change_(is_held);
  if (is_held) return;
  ROS_WARN_STREAM("the robot stands: " << named_
                                       << (is_silent ? " was held, but its joystick fell silent; "
                                                       "release it and press it again to go on"
                                                     : " was released; press it to go on"));
}

bool HoldButton::isHeld() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return hold_.isHeld(replay::sinceBoot());
}

bool HoldButton::isHeldSteadily() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return hold_.isHeldSteadily(replay::sinceBoot());
}

/// Returns why nobody could hold it; empty: somebody could.
std::string HoldButton::whyNot() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!has_button_) return "there is no " + named_;
  if (hold_.hasFallenSilent(replay::sinceBoot())) {
    return named_ +
           " was held, but its joystick fell silent (joy_node repeats itself with "
           "_autorepeat_rate:=20)";
  }
  return "";
}

void HoldButton::waitUntilHeld(const std::function<bool()>& is_stopped) {
  if (isHeldSteadily() || is_stopped()) return;
  ROS_WARN_STREAM("hold " << named_ << " to let the robot move; it stops when you release it");
  const auto isHeld = [this] {
    if (const std::string why = whyNot(); !why.empty()) throw replay::MotionRefused(why);
    return isHeldSteadily();
  };
  if (waitUntil(deadlineIn(options_.patience_s), is_stopped, isHeld) || is_stopped()) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  throw replay::MotionRefused(
      !hold_.hasBeenHeard()     ? "nobody sends " + options_.topic + " (" + named_ + ")"
      : hold_.hasToBeReleased() ? named_ + " was pressed before and not released"
                                : "nobody held " + named_);
}

}  // namespace afterglow::nodes
