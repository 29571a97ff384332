#include "nodes/player/stop_inputs.hpp"

#include <fmt/format.h>
#include <ros/master.h>

#include <charconv>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "nodes/tools/ros_graph.hpp"
#include "replay/clock/steady_time.hpp"
#include "replay/messages/ranges.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/plan/permission.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kAskingPeriod = 0.25;  // s
// s, for one answer on a busy machine; after one that was late the next is asked for at once.
constexpr double kMasterAnswer = 1.1, kNodeAnswer = 0.6;
constexpr int kMostUnheeded = 1;

}  // namespace

MasterMonitor::MasterMonitor(std::function<void(const std::string&)> on_lost)
    : on_lost_(std::move(on_lost)) {
  thread_.every(kAskingPeriod, [this] { look(); });
  thread_.begin();
}

void MasterMonitor::look() {
  if (missed_ > kMostUnheeded) return;
  missed_ = master_.isThere(deadlineIn(kMasterAnswer)) ? 0 : missed_ + 1;
  if (missed_ > kMostUnheeded) on_lost_("the ROS master is gone (" + ros::master::getURI() + ")");
}

PublisherMonitor::PublisherMonitor(std::function<void(const std::string&)> on_gone)
    : on_gone_(std::move(on_gone)) {
  thread_.every(kAskingPeriod, [this] { look(); });
  thread_.begin();
}

void PublisherMonitor::add(const std::string& node) {
  const std::lock_guard<std::mutex> lock(mutex_);
  nodes_.insert(node);
}

/// Asks without the lock, which callbacks need.
void PublisherMonitor::look() {
  std::set<std::string> nodes;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    nodes = nodes_;
  }
  for (const std::string& node : nodes) {
    if (has_told_ || !isGone(node)) continue;
    has_told_ = true;
    on_gone_(node);
  }
}

bool PublisherMonitor::isGone(const std::string& node) {
  Known& known = known_[node];
  if (!known.address) known.address = addressOf(node, deadlineIn(kNodeAnswer));
  const bool answers = known.address && isAlive(*known.address, deadlineIn(kNodeAnswer));
  known.unanswered = answers ? 0 : known.unanswered + 1;
  return known.unanswered > kMostUnheeded;
}

namespace {

constexpr double kFirstWord = 2.0;          // s, for a latched word
constexpr double kPeriodPatience = 0.6;     // s, in which a topic of 10 Hz shows its period
constexpr double kSilenceLook = 0.02;       // s, for silence
constexpr double kPublisherPatience = 1.0;  // s, for a node to answer
constexpr const char* kNoStop = "none";

/// Returns the bounds of the silence; a stop that is sent on change may be silent for ever.
replay::SilenceBounds boundsOf(double longest_silence_s) {
  const std::int64_t given_ns = std::llround(longest_silence_s * 1e9);
  return given_ns > 0 ? replay::SilenceBounds{given_ns, given_ns} : replay::SilenceBounds();
}

}  // namespace

void EmergencyStopOptions::set(const std::string& text) {
  const std::size_t colon = text.find(':');
  const std::string named = text.substr(0, colon);
  std::string named_field = colon == std::string::npos ? "" : text.substr(colon + 1);
  const bool is_inverted = !named_field.empty() && named_field.front() == '!';
  if (is_inverted) named_field.erase(0, 1);
  const bool is_topic = named.size() > 1 && named.front() == '/';
  const bool has_field = colon == std::string::npos || !named_field.empty();
  if (text != kNoStop && (!is_topic || !has_field)) {
    throw std::invalid_argument("'" + text + "' is no /TOPIC, /TOPIC:FIELD or /TOPIC:!FIELD");
  }
  topic = text == kNoStop ? "" : replay::TopicName(named).text();
  field = named_field;
  stops_when = !is_inverted;
  profile.clear();
}

std::string EmergencyStopOptions::text() const {
  if (topic.empty()) return kNoStop;
  return topic + (field.empty() ? "" : (stops_when ? ":" : ":!") + field);
}

EmergencyStop::EmergencyStop(const EmergencyStopOptions& options,
                             std::function<void(const std::string&)> on_stop)
    : options_(options),
      on_stop_(std::move(on_stop)),
      field_(options.field, options.stops_when),
      silence_(boundsOf(options.longest_silence_s)),
      living_([this](const std::string& node) {
        stop("the publisher of the emergency stop is gone: " + node + " (" + options_.text() + ")");
      }) {
  subscriber_ = thread_.hear<AnyMessage>(options_.topic, 10,
                                         [this](const AnyMessage& event) { onMessage(event); });
  thread_.every(kSilenceLook, [this] { onTimer(); });
  thread_.begin();
}

std::string EmergencyStop::named() const {
  return options_.text() + (options_.profile.empty()
                                ? ""
                                : ", which the profile " + options_.profile +
                                      " names (--estop-topic: another one, or none)");
}

void EmergencyStop::check() {
  const RosGraph graph = askMaster(deadlineIn(kMasterPatience));
  bool is_published = false;
  for (const std::string& node : graph.otherPublishers(subscriber_.getTopic())) {
    is_published = is_published || isAlive(node, deadlineIn(kPublisherPatience));
  }
  if (!is_published) throw replay::MotionRefused("nobody publishes the emergency stop " + named());
  waitForNews();
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!problem_.empty()) throw replay::MotionRefused(problem_);
  if (silence_.hasBeenHeard()) {
    publishers_ = subscriber_.getNumPublishers();
    return;
  }
  throw replay::MotionRefused("nothing is heard of the emergency stop " + named());
}

/// Waits for the first message, then until its period is known, or it seems to have none.
void EmergencyStop::waitForNews() {
  waitUntil(deadlineIn(kFirstWord), [this] {
    const std::lock_guard<std::mutex> lock(mutex_);
    return !problem_.empty() || silence_.hasBeenHeard();
  });
  waitUntil(deadlineIn(kPeriodPatience), [this] {
    const std::lock_guard<std::mutex> lock(mutex_);
    return !problem_.empty() || !silence_.hasBeenHeard() || silence_.longestSilence();
  });
}

void EmergencyStop::onMessage(const AnyMessage& event) {
  const auto& message = event.getConstMessage();
  living_.add(event.getPublisherName());
  std::string reason;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    silence_.heard(replay::sinceBoot());
    problem_.clear();
    try {
      if (field_.stops(message->getDataType(), message->getMessageDefinition(),
                       bytesOf(*message))) {
        problem_ = "the emergency stop is pressed (" + options_.text() + ")";
        reason = "the emergency stop was pressed (" + options_.text() + ")";
      }
    } catch (const replay::MessageError& error) {
      reason = "the emergency stop cannot be read (" + options_.text() + "): " + error.what();
      problem_ = reason;
    }
  }
  if (!reason.empty()) stop(reason);
}

void EmergencyStop::onTimer() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (publishers_ == 0) return;  // not checked yet
    const bool is_silent = silence_.isOverdue(replay::sinceBoot());
    if (subscriber_.getNumPublishers() >= publishers_ && !is_silent) return;
  }
  const bool is_gone = subscriber_.getNumPublishers() < publishers_;
  stop(is_gone ? "the publisher of the emergency stop is gone (" + options_.text() + ")"
               : "the emergency stop is silent (" + options_.text() + ")");
}

void EmergencyStop::stop(const std::string& reason) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (std::exchange(has_stopped_, true)) return;
  }
  on_stop_(reason);
}

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
