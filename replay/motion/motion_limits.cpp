#include "replay/motion/motion_limits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "replay/clock/timeline.hpp"
#include "replay/messages/document.hpp"
#include "replay/messages/schema.hpp"
#include "replay/motion/goal_remainder.hpp"
#include "replay/motion/joint_track.hpp"
#include "replay/motion/motion_rate.hpp"
#include "replay/motion/odd_number.hpp"
#include "replay/motion/velocity.hpp"

namespace afterglow::replay {
namespace {

constexpr double kUnknownJointMargin = 1.05;
constexpr double kRounding = 1e-6;  // of a limit: a velocity at the limit is allowed
/// Joint states are told and recorded with delays.
constexpr std::int64_t kRecordedAroundNs = 250'000'000;

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
  void addSpeed(double value) { add("linear velocity", "m/s", 1, value, limits_.linear); }
  /// Of a joint whose name and own limit the message does not tell: its controller has one.
  void addAskedVelocity(double value) {
    add("velocity asked for", "rad/s or m/s", 1, value,
        limits_.other_joints.velocity.value_or(std::numeric_limits<double>::infinity()));
  }
  void addJointVelocity(const std::string& joint, double value) {
    add("velocity of " + joint, "rad/s or m/s", 1, value, limits_.of(joint).velocity,
        kUnknownJointMargin);
  }
  void addJointAcceleration(const std::string& joint, double value) {
    const auto limit = limits_.of(joint).acceleration;
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

/// A number of either size.
std::optional<double> numberAt(const Value& message, const std::string& path) {
  const Value* value = findValue(message, path);
  if (!value) return std::nullopt;
  if (const auto* number = std::get_if<double>(value)) return *number;
  if (const auto* number = std::get_if<float>(value)) return *number;
  return std::nullopt;
}

void addTrajectory(const Trajectory& trajectory, double sent_at_s, std::vector<double> before,
                   PeakFinder& peaks) {
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

std::array<double, 3> vectorAt(const Value& message, const std::string& path) {
  std::array<double, 3> vector{};
  for (std::size_t i = 0; i < 3; ++i) {
    vector[i] = numberAt(message, path + "." + "xyz"[i]).value_or(0);
  }
  return vector;
}

/// Elements of an array of messages; none for every other value.
const Array& elementsAt(const Value& message, const char* path) {
  static const Array kNone;
  const Value* value = findValue(message, path);
  const Array* array = value ? std::get_if<Array>(value) : nullptr;
  return array ? *array : kNone;
}

/// Of bodies that fly or swim: trajectory_msgs/MultiDOFJointTrajectory.
void addBodies(const Value& document, double sent_at_s, PeakFinder& peaks) {
  std::vector<std::array<double, 3>> before;
  double before_s = 0;
  for (const Value& point : elementsAt(document, "points")) {
    const double at_s = static_cast<double>(timeFromStartNs(point)) * 1e-9;
    peaks.setTime(sent_at_s + at_s);
    for (const Value& velocity : elementsAt(point, "velocities")) {
      const auto linear = vectorAt(velocity, "linear"), angular = vectorAt(velocity, "angular");
      peaks.addVelocity({linear[0], linear[1], linear[2], angular[0], angular[1], angular[2]});
    }
    std::vector<std::array<double, 3>> places;
    for (const Value& transform : elementsAt(point, "transforms")) {
      places.push_back(vectorAt(transform, "translation"));
    }
    for (std::size_t i = 0; i < places.size() && i < before.size() && at_s > before_s; ++i) {
      const auto& [from, to] = std::tie(before[i], places[i]);
      peaks.addSpeed(std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]) /
                     (at_s - before_s));
    }
    before = std::move(places);
    before_s = at_s;
  }
}

/// ackermann_msgs: its speed, and how fast it steers.
void addDrive(const Value& document, PeakFinder& peaks) {
  const Value* stamped = findValue(document, "drive");
  const Value& drive = stamped ? *stamped : document;
  peaks.addSpeed(numberAt(drive, "speed").value_or(0));
  if (const double steering = numberAt(drive, "steering_angle_velocity").value_or(0);
      steering != 0) {
    peaks.addJointVelocity("the steering", steering);
  }
}

/// std_msgs/Float64 and Float64MultiArray of a controller of velocities.
void addJoints(const Value& document, PeakFinder& peaks) {
  if (const auto velocity = numberAt(document, "data")) peaks.addJointVelocity("data", *velocity);
  const std::vector<double> velocities = numbersAt(document, "data");
  for (std::size_t i = 0; i < velocities.size(); ++i) {
    peaks.addJointVelocity(fmt::format("data[{}]", i), velocities[i]);
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

/// The peaks of one topic.
class TopicPeaks {
 public:
  TopicPeaks(const Store& store, const PlayPlan& plan, const PlannedTopic& topic,
             PeakFinder& peaks)
      : store_(store),
        plan_(plan),
        topic_(topic),
        peaks_(peaks),
        schema_(Schema::parse(topic.channel.type, topic.channel.definition)) {}

  /// Throws std::runtime_error for a number that is none.
  void add(const Message& message) {
    const double at_s = PlaybackTime{message.received.ns - plan_.behavior.begin.ns}.seconds();
    std::string odd;
    try {
      Value document = decode(schema_, message.bytes);
      odd = oddNumber(document);
      peaks_.setTime(at_s);
      if (odd.empty()) addMotion(message, document, at_s);
    } catch (const MessageError&) {
      return;
    }
    if (!odd.empty()) {
      throw std::runtime_error(
          fmt::format("{}: {}, {:.4g} s into the behavior: motion that is no number is not sent",
                      topic_.channel.topic, odd, at_s));
    }
  }

 private:
  void addMotion(const Message& message, Value& document, double at_s) {
    const StopKind stop = stopOf(topic_).kind;
    if (isVelocity(topic_.channel)) {
      peaks_.addVelocity(velocityOf(message.bytes));
    } else if (stop == StopKind::Speed) {
      addDrive(document, peaks_);
    } else if (hasJointVelocities(topic_)) {
      addJoints(document, peaks_);
    } else if (const auto trajectory = trajectoryIn(document)) {
      addTrajectory(*trajectory, at_s, positionsBefore(*trajectory, message.received), peaks_);
      addBodies(document, at_s, peaks_);
    } else if (const double asked = numberAt(document, "goal.max_velocity").value_or(0);
               asked != 0) {
      peaks_.addAskedVelocity(asked);
    }
  }

  /// One point says nothing of its velocity: it is reached from where the joints were. Empty where
  /// that is not known, and for trajectories of more points.
  std::vector<double> positionsBefore(const Trajectory& trajectory, Stamp at) {
    if (trajectory.points->size() != 1) return {};
    if (!joints_) joints_ = JointTrack::read(store_, plan_.behavior, plan_.begin, plan_.end);
    const std::vector<double> there = numbersAt(trajectory.points->front(), "positions");
    std::vector<double> positions;
    for (std::size_t i = 0; i < trajectory.joints.size() && i < there.size(); ++i) {
      const auto reach = joints_->around(trajectory.joints[i], at, kRecordedAroundNs);
      if (!reach) return {};
      // It may turn without an end: by the short way.
      positions.push_back(there[i] - wrapAngle(there[i] - reach->at));
    }
    return positions;
  }

  const Store& store_;
  const PlayPlan& plan_;
  const PlannedTopic& topic_;
  PeakFinder& peaks_;
  const Schema schema_;
  std::optional<JointTrack> joints_;  ///< once they are asked for
};

void addTopicPeaks(const Store& store, const PlayPlan& plan, const PlannedTopic& topic,
                   PeakFinder peaks) {
  TopicPeaks found(store, plan, topic, peaks);
  const auto cursor = store.messages(plan.behavior, {{topic.channel.topic}, plan.begin, plan.end});
  while (const auto message = cursor->next()) found.add(*message);
  refuseDamage(plan, topic, cursor->damaged());
  peaks.finish();
}

}  // namespace

const MotionLimits::Joint& MotionLimits::of(const std::string& joint) const {
  const auto known = joints.find(joint);
  return known == joints.end() ? other_joints : known->second;
}

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
