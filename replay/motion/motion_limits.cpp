#include "replay/motion/motion_limits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
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
#include "replay/motion/planar_pose.hpp"
#include "replay/motion/pose_track.hpp"

namespace afterglow::replay {
namespace {

std::string oddIn(double number, const std::string& path) {
  return std::isfinite(number) ? "" : fmt::format("{} is {}", path, number);
}

template <typename Number>
std::string oddOf(const Bytes& numbers, const std::string& path) {
  for (std::size_t i = 0; i * sizeof(Number) < numbers.size(); ++i) {
    Number number;
    std::memcpy(&number, numbers.data() + i * sizeof(Number), sizeof(Number));
    if (!std::isfinite(number)) return oddIn(number, fmt::format("{}[{}]", path, i));
  }
  return "";
}

std::string oddBelow(const Value& value, const std::string& path) {
  if (const auto* number = std::get_if<double>(&value)) return oddIn(*number, path);
  if (const auto* number = std::get_if<float>(&value)) return oddIn(*number, path);
  if (const auto* numbers = std::get_if<NumberArray>(&value)) {
    return numbers->type == FieldType::Float64   ? oddOf<double>(numbers->bytes, path)
           : numbers->type == FieldType::Float32 ? oddOf<float>(numbers->bytes, path)
                                                 : "";
  }
  if (const auto* array = std::get_if<Array>(&value)) {
    for (std::size_t i = 0; i < array->size(); ++i) {
      std::string odd = oddBelow((*array)[i], fmt::format("{}[{}]", path, i));
      if (!odd.empty()) return odd;
    }
  }
  if (const auto* object = std::get_if<Object>(&value)) {
    for (const auto& [name, field] : *object) {
      std::string odd = oddBelow(field, path.empty() ? name : path + "." + name);
      if (!odd.empty()) return odd;
    }
  }
  return "";
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMargin = 1.05;    // of what was recorded
constexpr double kRounding = 1e-6;  // of a limit: a velocity at the limit is allowed
constexpr double kBeyondTurning = 0.02, kBeyondSliding = 0.005;  // rad, m, of a joint's range
/// The fastest where no limit is known: m/s, rad/s, and rad/s or m/s of a joint.
constexpr double kFastestLinear = 3, kFastestAngular = 10, kFastestJoint = 10;
/// So near to where it was, a joint is there.
constexpr double kThereTurning = 0.1, kThereSliding = 0.02;  // rad, m
/// A base's acceleration is that over so long, s, as velocities come irregularly; and at most.
constexpr double kRampOver = 0.1, kRampAtMost = 0.25;
constexpr const char* kUnknown =
    ", as fast as it was: what it may do is not known (--robot, --limits)";
constexpr const char* kUnknownRobot =
    ", which holds for robots of which no limit is known (--robot)";

[[noreturn]] void refuse(const std::string& topic, const std::string& what, double at_s) {
  throw std::runtime_error(fmt::format("{}: {}, {:.4g} s into the behavior", topic, what, at_s));
}

/// Collects peaks of a topic by kind.
class PeakFinder {
 public:
  PeakFinder(const MotionLimits& limits, std::string topic)
      : limits_(limits), topic_(std::move(topic)) {}

  const std::string& topic() const { return topic_; }
  double at() const { return at_s_; }
  void setTime(double at_s) { at_s_ = at_s; }

  void addVelocity(const Velocity& v) {
    addSpeed(std::hypot(v[0], v[1], v[2]));
    add({topic_, "angular velocity", "rad/s"}, std::hypot(v[3], v[4], v[5]), limits_.angular,
        kFastestAngular);
  }
  void addSpeed(double value) {
    add({topic_, "linear velocity", "m/s"}, value, limits_.linear, kFastestLinear);
  }
  /// A velocity of a base that ramps by itself: what it was told once it may be told again, but
  /// faster only if it can follow.
  void addRamp(const Velocity& from, const Velocity& to, double seconds) {
    const auto change = [&](std::size_t i) {
      const double x = to[i] - from[i], y = to[i + 1] - from[i + 1], z = to[i + 2] - from[i + 2];
      return std::hypot(x, y, z) / seconds;
    };
    const auto add_ramp = [&](const char* what, const char* unit, double value,
                              const std::optional<double>& limit) {
      if (limit) keep({topic_, what, unit, 2, 0, 0, *limit, std::max(*limit, value)}, value);
    };
    add_ramp("linear acceleration", "m/s^2", change(0), limits_.linear_acceleration);
    add_ramp("angular acceleration", "rad/s^2", change(3), limits_.angular_acceleration);
  }
  /// A velocity of a joint whose name and own limit the message does not tell: its controller has
  /// one.
  void addAskedVelocity(double value) {
    add({topic_, "velocity asked for", "rad/s or m/s"}, value,
        limits_.other_joints.velocity.value_or(kInfinity), kInfinity);
  }
  void addJointVelocity(const std::string& joint, double value) {
    add({topic_, "velocity of " + joint, "rad/s or m/s"}, value, limits_.of(joint).velocity,
        kFastestJoint);
  }
  void addJointAcceleration(const std::string& joint, double value) {
    const auto limit = limits_.of(joint).acceleration;
    if (limit) add({topic_, "acceleration of " + joint, "rad/s^2 or m/s^2", 2}, value, limit, 0);
  }
  void addTo(std::vector<MotionPeak>& peaks) const {
    for (const auto& [what, peak] : found_) peaks.push_back(peak);
  }

 private:
  void add(MotionPeak peak, double value, const std::optional<double>& limit, double fastest) {
    value = std::abs(value);
    const double again = value * kMargin;
    peak.remark = limit ? "" : again < fastest ? kUnknown : kUnknownRobot;
    peak.limit = limit.value_or(std::min(again, fastest));
    peak.allowed = limit ? std::max(*limit, std::min(value, *limit * kMargin)) : peak.limit;
    keep(std::move(peak), value);
  }
  void keep(MotionPeak peak, double value) {
    MotionPeak& found = found_[peak.what];
    if (value < found.value) return;
    peak.value = value;
    peak.at_s = at_s_;
    found = std::move(peak);
  }

  const MotionLimits& limits_;
  const std::string topic_;
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

/// Adds bodies that fly or swim: trajectory_msgs/MultiDOFJointTrajectory.
void addBodies(const Value& document, double sent_at_s, PeakFinder& peaks) {
  std::vector<std::array<double, 3>> before;
  double before_s = 0;
  for (const Value& point : elementsAt(document, "points")) {
    const double at_s = secondsOf(point);
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

/// Reads what moves the body, topic by topic.
class PeakReader {
 public:
  PeakReader(const Store& store, const PlayPlan& plan, const MotionLimits& limits,
             const RobotJoints& robot, bool is_base_timed)
      : store_(store),
        plan_(plan),
        limits_(limits),
        robot_(robot),
        is_base_timed_(is_base_timed) {}

  void read(const PlannedTopic& topic, std::vector<MotionPeak>& found) {
    PeakFinder peaks(limits_, topic.channel.topic);
    const Schema schema = Schema::of(topic.channel);
    last_.reset();
    // A motion under way where the replay begins goes on in it.
    const Stamp from = isGoal(topic.channel) ? plan_.behavior.begin : plan_.begin;
    const auto cursor = store_.messages(plan_.behavior, {{topic.channel.topic}, from, plan_.end});
    while (const auto message = cursor->next()) {
      peaks.setTime(PlaybackTime{message->received.ns - plan_.behavior.begin.ns}.seconds());
      try {
        Value document = decode(schema, message->bytes);
        if (const std::string odd = oddNumber(document); !odd.empty()) {
          throw std::runtime_error(fmt::format(
              "{}: {}, {:.4g} s into the behavior: motion that is no number is not sent",
              topic.channel.topic, odd, peaks.at()));
        }
        add(topic, *message, document, peaks);
      } catch (const MessageError&) {  // it is refused when it is played, too
      }
    }
    refuseDamage(plan_, topic, cursor->damaged());
    peaks.addTo(found);
  }

 private:
  void add(const PlannedTopic& topic, const Message& message, Value& document, PeakFinder& peaks) {
    const double at_s = peaks.at();
    if (isVelocity(topic.channel)) {
      addVelocity(message, peaks);
    } else if (stopOf(topic).kind == StopKind::Speed) {
      addDrive(document, peaks);
    } else if (hasJointVelocities(topic)) {
      addJoints(document, peaks);
    } else if (const auto trajectory = trajectoryIn(document)) {
      const Array& points = *trajectory->points;
      const double over_s = points.empty() ? 0 : secondsOf(points.back());
      if (later(message.received, std::max(0., over_s)) < plan_.begin) return;
      addTrajectory(*trajectory, message.received, peaks);
      addBodies(document, at_s, peaks);
    } else if (const double asked = numberAt(document, "goal.max_velocity").value_or(0);
               asked != 0) {
      peaks.addAskedVelocity(asked);
    }
  }

  /// Adds a trajectory as it was sent: its times, its positions, and how fast it is. Throws
  /// std::runtime_error for what no robot is told.
  void addTrajectory(const Trajectory& trajectory, Stamp sent, PeakFinder& peaks) {
    const double sent_at_s = peaks.at();
    std::vector<double> before;
    double before_s = 0;
    for (std::size_t k = 0; k < trajectory.points->size(); ++k) {
      const Value& point = (*trajectory.points)[k];
      const double at_s = secondsOf(point);
      if (k > 0 ? at_s <= before_s : at_s < 0) {
        refuse(peaks.topic(),
               fmt::format("points[{}] is due at {:.4g} s, {}", k, at_s,
                           k > 0 ? fmt::format("the one before it at {:.4g} s: times have to rise",
                                               before_s)
                                 : "before the trajectory begins"),
               sent_at_s);
      }
      peaks.setTime(sent_at_s + at_s);
      const std::vector<double> positions = numbersAt(point, "positions");
      for (std::size_t i = 0; i < trajectory.joints.size(); ++i) {
        addOwn(trajectory.joints[i], point, i, peaks);
      }
      for (std::size_t i = 0; i < positions.size() && i < trajectory.joints.size(); ++i) {
        checkRange(trajectory.joints[i], positions[i], peaks);
        if (k == 0) {
          addFirst(trajectory.joints[i], positions[i], at_s, sent, peaks);
        } else if (i < before.size()) {
          peaks.addJointVelocity(trajectory.joints[i],
                                  (positions[i] - before[i]) / (at_s - before_s));
        }
      }
      before = positions;
      before_s = at_s;
    }
  }

  /// Adds what the point says of itself.
  static void addOwn(const std::string& name, const Value& point, std::size_t joint,
                     PeakFinder& peaks) {
    const std::vector<double> velocities = numbersAt(point, "velocities"),
                              accelerations = numbersAt(point, "accelerations");
    if (joint < velocities.size()) peaks.addJointVelocity(name, velocities[joint]);
    if (joint < accelerations.size()) peaks.addJointAcceleration(name, accelerations[joint]);
  }

  void checkRange(const std::string& joint, double position, const PeakFinder& peaks) const {
    const std::optional<JointRange>& range = limits_.of(joint).range;
    const double beyond = robot_.isSliding(joint) ? kBeyondSliding : kBeyondTurning;
    if (!range || (position >= (*range)[0] - beyond && position <= (*range)[1] + beyond)) return;
    refuse(peaks.topic(),
           fmt::format("{} would go to {:.4g}, and its range is {:.4g} to {:.4g}", joint, position,
                       (*range)[0], (*range)[1]),
           peaks.at());
  }

  /// The first point is reached from where the joint was, as far as that was recorded.
  void addFirst(const std::string& joint, double position, double at_s, Stamp sent,
                PeakFinder& peaks) {
    const auto reach = joints().around(joint, sent, JointTrack::kAroundNs);
    if (!reach) return;
    double way = position - reach->at;
    // It may turn without an end: by the short way.
    if (!robot_.isSliding(joint) && !limits_.of(joint).range) way = wrapAngle(way);
    const double there = robot_.isSliding(joint) ? kThereSliding : kThereTurning;
    const double off = reach->off(way);
    if (off <= there) return;
    if (at_s > 0) return peaks.addJointVelocity(joint, off / at_s);
    refuse(peaks.topic(),
           fmt::format("{} would go from {:.4g} to {:.4g} in 0 s", joint, reach->at, position),
           peaks.at());
  }

  void addVelocity(const Message& message, PeakFinder& peaks) {
    const Velocity velocity = velocityOf(message.bytes);
    peaks.addVelocity(velocity);
    if (is_base_timed_) return;
    const double since = last_ ? secondsBetween(last_->first, message.received) : kRampAtMost;
    if (last_ && since < kRampOver) return;
    peaks.addRamp(last_ ? last_->second : Velocity{}, velocity, std::min(since, kRampAtMost));
    last_ = {message.received, velocity};
  }

  const JointTrack& joints() {
    const Behavior& behavior = plan_.behavior;
    if (!joints_) joints_ = JointTrack::read(store_, behavior, behavior.begin, plan_.end);
    return *joints_;
  }

  const Store& store_;
  const PlayPlan& plan_;
  const MotionLimits& limits_;
  const RobotJoints& robot_;
  const bool is_base_timed_;
  std::optional<std::pair<Stamp, Velocity>> last_;  ///< last velocity of a base
  std::optional<JointTrack> joints_;                ///< once they are asked for
};

}  // namespace

std::string oddNumber(const Value& document) { return oddBelow(document, ""); }

std::string oddNumber(const Schema& schema, const Bytes& bytes) {
  return oddNumber(decode(schema, bytes));
}

const JointLimits& MotionLimits::of(const std::string& joint) const {
  const auto known = joints.find(joint);
  return known == joints.end() ? other_joints : known->second;
}

MotionLimits boundedBy(MotionLimits asked, const RobotJoints& joints, const RobotProfile& robot) {
  const auto bound = [](std::optional<double>& limit, std::optional<double> known) {
    if (known && *known > 0) limit = std::min(*known, limit.value_or(*known));
  };
  const RobotProfile::Base& base = robot.base;
  bound(asked.linear, base.fastest);
  bound(asked.angular, base.fastest_turn);
  bound(asked.linear_acceleration,
        base.linear_acceleration > 0 ? base.linear_acceleration : base.deceleration);
  bound(asked.angular_acceleration, base.angular_acceleration);
  // A joint that gets an entry of its own keeps the limits of the other joints.
  const JointLimits others = asked.other_joints;
  const auto limitsOf = [&](const std::string& joint) -> JointLimits& {
    return asked.joints.emplace(joint, others).first->second;
  };
  for (const auto& [name, joint] : joints.all()) {
    if (joint.fastest) bound(limitsOf(name).velocity, joint.fastest);
    if (joint.range) limitsOf(name).range = joint.range;
  }
  for (const auto& [name, said] : robot.joints) {
    const auto found = joints.all().find(name);
    const RobotJoint described = found != joints.all().end() ? found->second : RobotJoint();
    if (said.velocity && !described.fastest) bound(limitsOf(name).velocity, said.velocity);
    if (said.acceleration) bound(limitsOf(name).acceleration, said.acceleration);
    const bool has_range = said.range && !described.range && !joints.isEndless(name);
    if (has_range) limitsOf(name).range = said.range;
  }
  return asked;
}

std::vector<MotionPeak> motionPeaks(const Store& store, const PlayPlan& plan,
                                    const MotionLimits& limits, const RobotJoints& robot,
                                    bool is_base_timed) {
  std::vector<MotionPeak> peaks;
  PeakReader reader(store, plan, limits, robot, is_base_timed);
  for (const PlannedTopic& topic : plan.topics) {
    if (topic.movesBody()) reader.read(topic, peaks);
  }
  return peaks;
}

std::string whyTooFast(const std::vector<MotionPeak>& peaks, double rate) {
  for (const MotionPeak& peak : peaks) {
    const double value = peak.value * std::pow(rate, peak.power);
    if (value > peak.allowed * (1 + kRounding)) {
      return fmt::format(
          "{}: {} of {:.4g} {} at rate {:.4g}, {:.4g} s into the behavior, is above the limit of "
          "{:.4g}{}",
          peak.topic, peak.what, value, peak.unit, rate, peak.at_s, peak.limit, peak.remark);
    }
  }
  return {};
}

}  // namespace afterglow::replay
