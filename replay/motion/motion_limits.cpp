#include "replay/motion/motion_limits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "replay/clock/timeline.hpp"
#include "replay/messages/document.hpp"
#include "replay/messages/schema.hpp"
#include "replay/motion/goal_remainder.hpp"
#include "replay/motion/velocity.hpp"

namespace afterglow::replay {
namespace {

constexpr double kUnknownJointMargin = 1.05;
constexpr double kRounding = 1e-6;  // of a limit: a velocity at the limit is allowed

/// Collects peaks by topic and kind.
class PeakFinder {
 public:
  PeakFinder(const MotionLimits& limits, std::string topic, std::vector<MotionPeak>& peaks)
      : limits_(limits), topic_(std::move(topic)), peaks_(peaks) {}

  void setTime(double at_s) { at_s_ = at_s; }

  void addVelocity(const Velocity& v) {
    add("linear velocity", "m/s", 1, std::hypot(v[0], v[1], v[2]), limits_.linear);
    add("angular velocity", "rad/s", 1, std::hypot(v[3], v[4], v[5]), limits_.angular);
  }
  void addJointVelocity(const std::string& joint, double value) {
    add("velocity of " + joint, "rad/s or m/s", 1, value, limitsOf(joint).velocity,
        kUnknownJointMargin);
  }
  void addJointAcceleration(const std::string& joint, double value) {
    const auto limit = limitsOf(joint).acceleration;
    if (limit) add("acceleration of " + joint, "rad/s^2 or m/s^2", 2, value, limit);
  }
  /// Once all is added.
  void finish() {
    for (auto& [what, peak] : found_) {
      if (!limits_.is_strict) peak.limit = std::max(peak.limit, peak.value);
      peaks_.push_back(std::move(peak));
    }
  }

 private:
  MotionLimits::Joint limitsOf(const std::string& joint) const {
    const auto known = limits_.joints.find(joint);
    return known == limits_.joints.end() ? limits_.other_joints : known->second;
  }
  void add(const std::string& what, const std::string& unit, int power, double value,
           std::optional<double> limit, double margin = 1) {
    value = std::abs(value);
    if (!std::isfinite(value)) return;
    MotionPeak& peak = found_[what];
    if (value < peak.value) return;
    peak = {topic_, what, unit, power, value, at_s_, limit.value_or(value * margin),
            limit.has_value()};
  }

  const MotionLimits& limits_;
  const std::string topic_;
  std::vector<MotionPeak>& peaks_;
  double at_s_ = 0;
  std::map<std::string, MotionPeak> found_;
};

void addTrajectory(const Trajectory& trajectory, double sent_at_s, PeakFinder& peaks) {
  std::vector<double> before;
  double before_s = 0;
  for (const Value& point : *trajectory.points) {
    const double at_s = static_cast<double>(timeFromStartNs(point)) * 1e-9;
    const std::vector<double> positions = numbersAt(point, "positions"),
                              velocities = numbersAt(point, "velocities"),
                              accelerations = numbersAt(point, "accelerations");
    peaks.setTime(sent_at_s + at_s);
    for (std::size_t i = 0; i < trajectory.joints.size(); ++i) {
      const std::string& joint = trajectory.joints[i];
      if (i < velocities.size()) peaks.addJointVelocity(joint, velocities[i]);
      if (i < accelerations.size()) peaks.addJointAcceleration(joint, accelerations[i]);
      if (i < positions.size() && i < before.size() && at_s > before_s) {
        peaks.addJointVelocity(joint, (positions[i] - before[i]) / (at_s - before_s));
      }
    }
    before = positions;
    before_s = at_s;
  }
}

void refuseDamage(const PlayPlan& plan, const PlannedTopic& topic,
                  const std::vector<DamagedMessage>& damaged) {
  if (damaged.empty()) return;
  const PlaybackTime at{damaged.front().received.ns - plan.behavior.begin.ns};
  throw StoreError(fmt::format(
      "{}: {} of its messages are damaged in the store, the first {:.4g} s into the behavior: the "
      "body is not moved by what is left (store check names what is damaged; ar,speech can be "
      "played without)",
      topic.channel.topic, damaged.size(), at.seconds()));
}

void addTopicPeaks(const Store& store, const PlayPlan& plan, const PlannedTopic& topic,
                   PeakFinder peaks) {
  const Schema schema = Schema::parse(topic.channel.type, topic.channel.definition);
  const auto cursor = store.messages(plan.behavior, {{topic.channel.topic}, plan.begin, plan.end});
  while (const auto message = cursor->next()) {
    const double at_s = PlaybackTime{message->received.ns - plan.behavior.begin.ns}.seconds();
    try {
      if (isVelocity(topic.channel)) {
        peaks.setTime(at_s);
        peaks.addVelocity(velocityOf(message->bytes));
        continue;
      }
      Value document = decode(schema, message->bytes);
      if (const auto trajectory = trajectoryIn(document)) addTrajectory(*trajectory, at_s, peaks);
    } catch (const MessageError&) {
      continue;
    }
  }
  refuseDamage(plan, topic, cursor->damaged());
  peaks.finish();
}

}  // namespace

std::vector<MotionPeak> motionPeaks(const Store& store, const PlayPlan& plan,
                                    const MotionLimits& limits) {
  std::vector<MotionPeak> peaks;
  for (const PlannedTopic& topic : plan.topics) {
    if (topic.isPlayed() && topic.modality == Modality::Body) {
      addTopicPeaks(store, plan, topic, PeakFinder(limits, topic.channel.topic, peaks));
    }
  }
  return peaks;
}

std::string whyTooFast(const std::vector<MotionPeak>& peaks, double rate) {
  for (const MotionPeak& peak : peaks) {
    const double value = peak.value * std::pow(rate, peak.power);
    if (value > peak.limit * (1 + kRounding)) {
      const char* unknown =
          ", as fast as it was: what it may do is not known (--robot, --limits)";
      return fmt::format(
          "{}: {} of {:.4g} {} at rate {:.4g}, {:.4g} s into the behavior, is above the limit of "
          "{:.4g}{}",
          peak.topic, peak.what, value, peak.unit, rate, peak.at_s, peak.limit,
          peak.is_limit_known ? "" : unknown);
    }
  }
  return {};
}

}  // namespace afterglow::replay
