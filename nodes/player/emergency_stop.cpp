#include "nodes/player/emergency_stop.hpp"

#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include "replay/messages/topic_name.hpp"
#include "replay/plan/refusal_text.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kFirstWord = 2.0;     // s, for a latched word
constexpr double kPeriodPatience = 0.6;        // s, in which a topic of 10 Hz shows its period
constexpr double kSilenceLook = 0.02;         // s, for silence
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
        stop("the publisher of the emergency stop is gone: " + node + " (" + options_.text() +
             ")");
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

}  // namespace afterglow::nodes
