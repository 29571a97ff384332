#include "replay/motion/arm_start.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "replay/messages/document.hpp"

namespace afterglow::replay {
namespace {

/// Joint states are told, recorded and replayed with delays: where a joint was around a moment
/// counts as where it was at it.
constexpr std::int64_t kAroundNs = 250'000'000;
/// A point that is due so soon is where the trajectory begins.
constexpr double kAtOnce = 0.05;
/// Nearer to the first point, the next one would be a jump for a joint that is a little off.
constexpr double kNearest = 0.02;
constexpr double kSettle = 0.2;
/// The peak of a way from rest to rest, as controllers interpolate it (cubic), over its mean.
constexpr double kCubicPeak = 1.5;

double secondsOf(const Value& point) { return static_cast<double>(timeFromStartNs(point)) * 1e-9; }

void setSeconds(Value& point, double seconds) {
  valueAt(point, "time_from_start") = toRosDuration(std::llround(seconds * 1e9));
}

/// A field that this trajectory uses gets a number for every joint.
void setIfUsed(Value& point, const char* field, const std::vector<double>& numbers) {
  Value& value = valueAt(point, field);
  if (numbersOf(value).size() == numbers.size()) value = numberArray(numbers);
}

Value pointAt(const Value& like, const std::vector<double>& positions,
              const std::vector<double>& velocities, double seconds) {
  const std::vector<double> zeros(positions.size());
  Value point = like;
  valueAt(point, "positions") = numberArray(positions);
  setIfUsed(point, "velocities", velocities);
  setIfUsed(point, "accelerations", zeros);
  setIfUsed(point, "effort", zeros);
  setSeconds(point, seconds);
  return point;
}

/// Adds to a point the part of `offsets` that is left after `share` of the time in which they fade
/// smoothly to zero.
void addOffsets(Value& point, const std::vector<double>& offsets, double share, double blend_s) {
  std::vector<double> positions = numbersAt(point, "positions"),
                      velocities = numbersAt(point, "velocities");
  const double left = 1 - share * share * (3 - 2 * share);
  const double slope = -6 * share * (1 - share) / blend_s;
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    positions[i] += offsets[i] * left;
    if (velocities.size() == offsets.size()) velocities[i] += offsets[i] * slope;
  }
  valueAt(point, "positions") = numberArray(positions);
  setIfUsed(point, "velocities", velocities);
}

void checkShape(const Trajectory& trajectory) {
  for (const Value& point : *trajectory.points) {
    const std::vector<double> positions = numbersAt(point, "positions");
    if (positions.size() != trajectory.joints.size()) {
      throw MessageError("a point of " + std::to_string(positions.size()) + " positions for " +
                         std::to_string(trajectory.joints.size()) + " joints");
    }
    if (!std::all_of(positions.begin(), positions.end(),
                     [](double position) { return std::isfinite(position); })) {
      throw MessageError("a position that is no number");
    }
  }
}

}  // namespace

/// How the joints of a trajectory stand to it; one number a joint.
struct ArmStart::Beginning {
  bool is_known = true;  ///< somebody tells where all of them are
  std::vector<double> positions, velocities;  ///< now
  /// Where the trajectory goes on, if that is known of all.
  std::optional<std::vector<double>> reference = std::vector<double>();
  bool is_at_once = false;  ///< the reference is the first point
  double lead_s = 0;
};

double ArmStart::speedOf(const std::string& joint) const {
  return options_.speed.of(options_.robot, joint);
}

double ArmStart::wayOf(const std::string& joint, double from, double to) const {
  return options_.robot.way(joint, from, to);
}

double ArmStart::deviationOf(const std::string& joint, const JointTrack::Reach& reach,
                             double now) const {
  const double off = wayOf(joint, reach.at, now);
  return std::max({0.0, off - (reach.most - reach.at), (reach.least - reach.at) - off});
}

/// The seconds that a joint needs if it may be elsewhere.
double ArmStart::leadOf(const std::string& joint, double then, double deviation,
                        double now) const {
  const double tolerance = toleranceOf(options_.robot, joint, options_.tolerances);
  if (deviation <= tolerance) {
    return 0;
  }
  const auto stood = halted_.find(joint);
  const bool was_halted =
      stood != halted_.end() && std::abs(wayOf(joint, stood->second, now)) <= tolerance;
  if (options_.elsewhere == ArmStartOptions::Elsewhere::Refuse && !was_halted) {
    const double off = std::abs(wayOf(joint, then, now));
    throw ArmElsewhere(deviationText(options_.robot, joint, off, then, now) +
                       ": --to-start (~to_start) takes it there first");
  }
  const bool goes_there = was_halted || options_.elsewhere == ArmStartOptions::Elsewhere::Approach;
  return goes_there ? kCubicPeak * std::abs(wayOf(joint, now, then)) / speedOf(joint) : 0;
}

/// For a joint of which nothing is known but the points it is to go through.
void ArmStart::checkSpeed(const Trajectory& trajectory, std::size_t joint, double now,
                          double& lead) const {
  const std::string& name = trajectory.joints[joint];
  double own = 0, before = 0, before_s = 0;
  for (const Value& point : *trajectory.points) {
    const double position = numbersAt(point, "positions")[joint], at_s = secondsOf(point);
    if (&point != &trajectory.points->front() && at_s > before_s) {
      own = std::max(own, std::abs(position - before) / (at_s - before_s));
    }
    before = position;
    before_s = at_s;
  }
  const auto limit = options_.limits.joints.find(name);
  const MotionLimits::Joint& limits =
      limit == options_.limits.joints.end() ? options_.limits.other_joints : limit->second;
  const bool is_single = trajectory.points->size() == 1;
  const double allowed =
      std::max({own, speedOf(name), is_single ? limits.velocity.value_or(0) : 0.0});
  const double first = numbersAt(trajectory.points->front(), "positions")[joint];
  const double way = std::abs(wayOf(name, now, first));
  const double time = std::max(secondsOf(trajectory.points->front()), kAtOnce);
  if (way / time > allowed && way > toleranceOf(options_.robot, name, options_.tolerances)) {
    lead = std::max(lead, leadOf(name, first, way, now));
  }
}

ArmStart::Beginning ArmStart::beginningOf(const Trajectory& trajectory, Stamp at) const {
  Beginning beginning;
  const Value& first = trajectory.points->front();
  beginning.is_at_once = secondsOf(first) <= kAtOnce;
  const std::vector<double> first_positions = numbersAt(first, "positions");
  for (std::size_t i = 0; i < trajectory.joints.size(); ++i) {
    const std::string& joint = trajectory.joints[i];
    const std::optional<LiveJoint> live = look_(joint);
    if (!live && options_.elsewhere != ArmStartOptions::Elsewhere::Accept) {
      throw ArmElsewhere("nobody tells where " + joint + " is (/joint_states)");
    }
    beginning.is_known = beginning.is_known && live;
    if (!live) continue;
    const auto reach = recorded_.around(joint, at, kAroundNs);
    const double reference = beginning.is_at_once ? first_positions[i] : reach ? reach->at : 0;
    if (reach) {
      const double deviation = deviationOf(joint, *reach, live->position);
      beginning.lead_s = std::max(beginning.lead_s,
                                  leadOf(joint, reach->at, deviation, live->position));
    } else if (beginning.is_at_once) {
      const double way = std::abs(wayOf(joint, live->position, reference));
      beginning.lead_s = std::max(beginning.lead_s, leadOf(joint, reference, way, live->position));
    } else {
      checkSpeed(trajectory, i, live->position, beginning.lead_s);
      beginning.reference.reset();
    }
    // A joint without an end is as many turns on as the trajectory.
    const double next = beginning.reference ? reference : first_positions[i];
    beginning.positions.push_back(next + wayOf(joint, next, live->position));
    beginning.velocities.push_back(live->velocity);
    if (beginning.reference) beginning.reference->push_back(reference);
  }
  return beginning;
}

std::optional<double> ArmStart::leadOf(const Channel& channel, const Bytes& goal, Stamp at) const {
  Value document = decode(Schema::parse(channel.type, channel.definition), goal);
  const auto trajectory = trajectoryIn(document);
  if (!trajectory || trajectory->points->empty()) {
    return std::nullopt;
  }
  checkShape(*trajectory);
  return beginningOf(*trajectory, at).lead_s;
}

/// From the joints' live positions on, without a lead: deviations are corrected along the way.
void ArmStart::beginAlong(const std::vector<std::string>& joints, const Beginning& now,
                          Array& points) const {
  points.erase(points.begin(),
               std::find_if_not(points.begin(), std::prev(points.end()), [&](const Value& point) {
                 const bool is_reference = now.is_at_once && &point == &points.front();
                 return is_reference || secondsOf(point) < kNearest;
               }));
  std::vector<double> offsets;
  double blend_s = 0, settle_s = kSettle;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const auto timeFor = [&](double way) {
      return kCubicPeak * std::abs(way) / speedOf(joints[i]);
    };
    const double last = numbersAt(points.back(), "positions")[i];
    settle_s = std::max(settle_s, timeFor(wayOf(joints[i], now.positions[i], last)));
    if (!now.reference) continue;
    offsets.push_back(wayOf(joints[i], (*now.reference)[i], now.positions[i]));
    blend_s = std::max(blend_s, timeFor(offsets.back()));
  }
  if (points.size() == 1 && secondsOf(points.front()) <= kAtOnce) {
    setSeconds(points.front(), settle_s);
  }
  blend_s = std::min(blend_s, secondsOf(points.back()));
  for (Value& point : points) {
    const double at_s = secondsOf(point);
    if (at_s < blend_s) addOffsets(point, offsets, at_s / blend_s, blend_s);
  }
}

Bytes ArmStart::begin(const Channel& channel, const Bytes& goal, Stamp at, double lead_s) const {
  const Schema schema = Schema::parse(channel.type, channel.definition);
  Value document = decode(schema, goal);
  const auto trajectory = trajectoryIn(document);
  if (!trajectory || trajectory->points->empty()) {
    return goal;
  }
  checkShape(*trajectory);
  moved_.insert(trajectory->joints.begin(), trajectory->joints.end());
  const Beginning now = beginningOf(*trajectory, at);
  Array& points = *trajectory->points;
  for (Value& point : points) setSeconds(point, secondsOf(point) + lead_s);
  if (!now.is_known) {
    return encode(schema, document);
  }
  const Value like = points.front();
  const std::vector<double> rest(now.positions.size());
  if (lead_s > 0) {
    if (now.reference && !now.is_at_once) {
      points.insert(points.begin(), pointAt(like, *now.reference, rest, lead_s));
    }
  } else {
    beginAlong(trajectory->joints, now, points);
  }
  points.insert(points.begin(),
                pointAt(like, now.positions, lead_s > 0 ? rest : now.velocities, 0));
  return encode(schema, document);
}

void ArmStart::halted() {
  halted_.clear();
  for (const std::string& joint : moved_) {
    if (const auto live = look_(joint)) halted_[joint] = live->position;
  }
}

}  // namespace afterglow::replay
