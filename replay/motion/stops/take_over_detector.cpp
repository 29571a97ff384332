#include "replay/motion/stops/take_over_detector.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "replay/messages/ranges.hpp"

namespace afterglow::replay {
namespace {

/// The time after which what was told before has left the multiplexer, and a ramp to a stand has
/// ended.
constexpr std::int64_t kRemembered = 2'000'000'000;
constexpr std::int64_t kRecent = 500'000'000;  // another input's velocity may be the one put out
constexpr int kExact = 5;                      // velocities after which nothing else is expected
constexpr double kTolerance = 0.02;            // m/s, rad/s
/// A multiplexer that ramps puts something out by then, and one zero on a joystick's release is
/// none that holds.
constexpr std::int64_t kHoldsStill = 400'000'000;

std::string drivesOn(const std::string& topic) {
  return "somebody else drives the base on " + topic;
}

}  // namespace

void TakeOverDetector::told(Stamp now, const Velocity& velocity) {
  forget(now);
  told_.push_back({now, velocity});
  if (isZero(velocity)) {
    suppressed_since_.reset();
  } else if (!suppressed_since_ || now < *suppressed_since_) {
    suppressed_since_ = now;
    puts_zeros_out_ = false;
  }
}

/// Also what a clock that was set back told later.
void TakeOverDetector::forget(Stamp now) {
  while (!told_.empty() && told_.front().at.ns < now.ns - kRemembered) told_.pop_front();
  while (!told_.empty() && now < told_.back().at) told_.pop_back();
}

std::string TakeOverDetector::onSelected(const std::string& selected) const {
  const bool is_topic = !selected.empty() && selected.front() == '/';
  if (selected == "__none") return "the multiplexer of the base passes nothing on";
  return is_topic && selected != topic_ ? drivesOn(selected) : "";
}

std::string TakeOverDetector::onInput(Stamp now, const std::string& topic,
                                      const Velocity& velocity) {
  if (isZero(velocity)) {
    zeros_[topic] = now;
    return holderOf(now);
  }
  inputs_[topic] = {now, velocity};
  return take_over_topics_.count(topic) > 0 ? drivesOn(topic) : "";
}

std::string TakeOverDetector::onOutput(Stamp now, const std::string& topic,
                                       const Velocity& velocity) {
  if (isZero(velocity)) {
    puts_zeros_out_ = true;
    return holderOf(now);
  }
  suppressed_since_.reset();
  forget(now);
  if (wasTold(velocity)) {
    exact_ = std::min(exact_ + 1, kExact);
    return "";
  }
  if (const std::string driver = driverOf(now, "", &velocity); !driver.empty()) return driver;
  return exact_ < kExact && isSlowerThanTold(velocity) ? "" : driverOf(now, topic, nullptr);
}

/// The input whose zeros come out in place of what is told. Zeros alone say nothing: many send them
/// all the time on an input that is not passed on.
std::string TakeOverDetector::holderOf(Stamp now) const {
  const bool is_suppressed = suppressed_since_ && puts_zeros_out_ && !told_.empty() &&
                             now.ns - suppressed_since_->ns > kHoldsStill &&
                             now.ns - told_.back().at.ns <= kRecent;
  if (!is_suppressed) return "";
  for (const auto& [topic, at] : zeros_) {
    if (now.ns - at.ns <= kRecent) return "somebody holds the base still on " + topic;
  }
  return "";
}

bool TakeOverDetector::wasTold(const Velocity& velocity) const {
  return anyOf(told_, [&](const Sent& sent) { return sent.velocity == velocity; });
}

/// Returns true if each number lies between standing and what was told.
bool TakeOverDetector::isSlowerThanTold(const Velocity& velocity) const {
  for (std::size_t i = 0; i < velocity.size(); ++i) {
    double least = 0, most = 0;
    for (const Sent& sent : told_) {
      least = std::min(least, sent.velocity[i]);
      most = std::max(most, sent.velocity[i]);
    }
    const bool is_between =
        velocity[i] >= least - kTolerance && velocity[i] <= most + kTolerance;
    if (!is_between) return false;
  }
  return true;
}

/// The input that sent this velocity, or any, just now; else the output.
std::string TakeOverDetector::driverOf(Stamp now, const std::string& output,
                                       const Velocity* velocity) const {
  for (const auto& [topic, sent] : inputs_) {
    const bool is_recent = now.ns - sent.at.ns <= kRecent;
    if (is_recent && (!velocity || sent.velocity == *velocity)) return drivesOn(topic);
  }
  return output.empty() ? "" : drivesOn(output);
}

}  // namespace afterglow::replay
