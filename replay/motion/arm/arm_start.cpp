#include "replay/motion/arm/arm_start.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "replay/messages/document.hpp"
#include "replay/messages/ranges.hpp"

namespace afterglow::replay {
namespace {

/// A point that is due so soon is where the trajectory begins.
constexpr double kAtOnce = 0.05;
/// Nearer to the first point, the next one would be a jump for a joint that is a little off.
constexpr double kNearest = 0.02;
constexpr double kSettle = 0.2;
/// A joint's position is heard so late at most, s: states at 50 Hz, transport, a busy machine.
constexpr double kUnheard = 0.1;
/// A head is taken to look where it was told within this time.
constexpr std::int64_t kLongestLookNs = 3'000'000'000;
/// The peak of a way from rest to rest with accelerations, as controllers interpolate it (quintic),
/// over its mean.
constexpr double kQuinticPeak = 1.875;

// How joints set off within a path: an arm is to be seen to begin, and is soon in step again.
constexpr double kTurningStart = 1, kSlidingStart = 0.25;     // rad/s^2, m/s^2
constexpr double kShortestRamp = 0.2, kLongestRamp = 2;       // s
constexpr double kLooksAhead = 1, kLookEvery = 0.02;          // s
constexpr double kTurningBlend = 0.1, kSlidingBlend = 0.02;   // rad/s, m/s: onto the path
/// The part of a ramp in which joints get onto the path: with what is left of its speed.
constexpr double kBlendPart = 0.6;
constexpr double kMoves = 0.03;  ///< rad/s or m/s; slower joints stand
constexpr double kFastestPace = 1.5, kWholePace = 0.9;

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

/// Makes a point with what the path's points have.
Value pointAt(const Value& like, const ArmPath& path, const ArmKnot& knot, double seconds) {
  Value point = like;
  valueAt(point, "positions") = numberArray(knot.positions);
  valueAt(point, "velocities") =
      numberArray(path.hasVelocities() ? knot.velocities : std::vector<double>());
  valueAt(point, "accelerations") =
      numberArray(path.hasAccelerations() ? knot.accelerations : std::vector<double>());
  setSeconds(point, seconds);
  return point;
}

/// Returns the rest as a goal of its own.
Bytes restAlone(const Channel& channel, const Bytes& goal, const GoalProgress& progress) {
  return remainderOfGoal(channel, goal, std::llround(progress.elapsed_s * 1e9));
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

bool isMoving(const Value& point) {
  return anyOf(numbersAt(point, "velocities"),
               [](double velocity) { return std::abs(velocity) > kMoves; });
}

void checkShape(const Trajectory& trajectory) {
  for (const Value& point : *trajectory.points) {
    const std::vector<double> positions = numbersAt(point, "positions");
    if (positions.size() != trajectory.joints.size()) {
      throw MessageError("a point of " + std::to_string(positions.size()) + " positions for " +
                         std::to_string(trajectory.joints.size()) + " joints");
    }
    if (!allOf(positions, [](double position) { return std::isfinite(position); })) {
      throw MessageError("a position that is no number");
    }
  }
}

/// A goal as a document, with the trajectory in it, which has a point.
struct DecodedGoal {
  /// Throws MessageError.
  DecodedGoal(const Channel& channel, const Bytes& goal)
      : schema(Schema::of(channel)),
        document(decode(schema, goal)),
        trajectory(trajectoryIn(document)) {
    if (trajectory && trajectory->points->empty()) trajectory.reset();
    if (trajectory) checkShape(*trajectory);
  }
  Bytes bytes() const { return encode(schema, document); }

  const Schema schema;
  Value document;
  std::optional<Trajectory> trajectory;
};

}  // namespace

/// The stance of a trajectory's joints to it; one number a joint.
struct ArmStart::Beginning {
  bool is_known = true;  ///< somebody tells where all of them are
  std::vector<double> positions, velocities;  ///< now
  /// The place where the trajectory goes on, if that is known of all.
  std::optional<std::vector<double>> reference = std::vector<double>();
  bool is_at_once = false;  ///< the reference is the first point
  double lead_s = 0;
  JointWay way;  ///< way to where the trajectory goes on, if it takes a lead
};

double ArmStart::speedOf(const std::string& joint) const {
  return options_.speed.of(options_.robot, joint);
}

double ArmStart::wayOf(const std::string& joint, double from, double to) const {
  return options_.robot.way(joint, from, to);
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

/// Checks a joint of which nothing is known but the points it is to go through.
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
  const double limit = options_.limits.of(name).velocity.value_or(0);
  const bool is_single = trajectory.points->size() == 1;
  const double allowed = std::max({own, speedOf(name), is_single ? limit : 0.0});
  const double first = numbersAt(trajectory.points->front(), "positions")[joint];
  const double way = std::abs(wayOf(name, now, first));
  const double time = std::max(secondsOf(trajectory.points->front()), kAtOnce);
  if (way / time > allowed && way > toleranceOf(options_.robot, name, options_.tolerances)) {
    lead = std::max(lead, leadOf(name, first, way, now));
  }
}

/// Empty for a joint that nobody tells of, if that is accepted.
std::optional<LiveJoint> ArmStart::liveOf(const std::string& joint) const {
  const std::optional<LiveJoint> live = look_(joint);
  if (!live && options_.elsewhere != ArmStartOptions::Elsewhere::Accept) {
    throw ArmElsewhere("nobody tells where " + joint + " is (/joint_states)");
  }
  return live;
}

ArmStart::Beginning ArmStart::beginningOf(const Trajectory& trajectory, Stamp at) const {
  Beginning beginning;
  const Value& first = trajectory.points->front();
  beginning.is_at_once = secondsOf(first) <= kAtOnce;
  const std::vector<double> first_positions = numbersAt(first, "positions");
  for (std::size_t i = 0; i < trajectory.joints.size(); ++i) {
    const std::string& joint = trajectory.joints[i];
    const std::optional<LiveJoint> live = liveOf(joint);
    beginning.is_known = beginning.is_known && live;
    if (!live) continue;
    const auto reach = recorded_.around(joint, at, JointTrack::kAroundNs);
    const double reference = beginning.is_at_once ? first_positions[i] : reach ? reach->at : 0;
    if (reach) {
      const double deviation = reach->off(wayOf(joint, reach->at, live->position));
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
  if (beginning.lead_s > 0 && beginning.is_known) {
    beginning.way = wayTo(trajectory.joints, beginning.positions,
                          beginning.reference.value_or(first_positions), at);
    beginning.lead_s = std::max(beginning.lead_s, beginning.way.seconds());
  }
  return beginning;
}

/// Returns the way, without rests if any way will do.
JointWay ArmStart::wayTo(const std::vector<std::string>& joints, const std::vector<double>& from,
                         const std::vector<double>& to, Stamp at) const {
  if (!options_.approach) return {};
  try {
    return options_.approach->wayTo(joints, from, to, at);
  } catch (const ApproachRefused& refusal) {
    throw ArmElsewhere(refusal.what());
  }
}

std::optional<double> ArmStart::leadOf(const Channel& channel, const Bytes& goal, Stamp at) const {
  const DecodedGoal decoded(channel, goal);
  if (!decoded.trajectory) return std::nullopt;
  return beginningOf(*decoded.trajectory, at).lead_s;
}

/// Returns what a joint is off the reference and has to make good. Joints that move are not where
/// they were heard to be: that much is no deviation to a controller that knows better.
double ArmStart::offsetOf(const Beginning& now, std::size_t joint, const std::string& name) const {
  const double off = wayOf(name, (*now.reference)[joint], now.positions[joint]);
  const double unheard = options_.controllers_join ? kUnheard * std::abs(now.velocities[joint]) : 0;
  return std::copysign(std::max(0.0, std::abs(off) - unheard), off);
}

/// Begins from the joints' live positions, without a lead: deviations are corrected along the way.
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
    offsets.push_back(offsetOf(now, i, joints[i]));
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

/// A single point says nothing of its velocity: it is reached from where the joints are.
void ArmStart::checkOnlyPoint(const Trajectory& trajectory, const Beginning& now, Stamp at) const {
  const Value& point = trajectory.points->front();
  const std::vector<double> there = numbersAt(point, "positions");
  const double seconds = std::max(secondsOf(point), kAtOnce);
  for (std::size_t i = 0; i < there.size(); ++i) {
    const std::string& joint = trajectory.joints[i];
    const std::optional<double> limit = options_.limits.of(joint).velocity;
    const auto reach = recorded_.around(joint, at, JointTrack::kAroundNs);
    const double own = reach ? std::abs(wayOf(joint, reach->at, there[i])) / seconds : 0;
    const double allowed = limit.value_or(std::max(own, speedOf(joint)));
    const double way = std::abs(wayOf(joint, now.positions[i], there[i]));
    // So far it may be off, and is corrected along the way.
    if (way - toleranceOf(options_.robot, joint, options_.tolerances) > allowed * seconds) {
      throw ArmElsewhere(
          fmt::format("{} would go from {:.3g} to {:.3g} in {:.3g} s, at {:.3g}/s: {:.3g}/s is the "
                      "limit",
                      joint, now.positions[i], there[i], seconds, way / seconds, allowed));
    }
  }
}

Bytes ArmStart::begin(const Channel& channel, const Bytes& goal, Stamp at, double lead_s) const {
  DecodedGoal decoded(channel, goal);
  const std::optional<Trajectory>& trajectory = decoded.trajectory;
  if (!trajectory) return goal;
  moved_.insert(trajectory->joints.begin(), trajectory->joints.end());
  const Beginning now = beginningOf(*trajectory, at);
  Array& points = *trajectory->points;
  // Who comes from elsewhere stands there, and has to set off again.
  if (lead_s > 0 && now.is_known && now.is_at_once && isMoving(points.front())) {
    return goOn(channel, goal, {at, at, 0}, lead_s);
  }
  const bool is_only_point = points.size() == 1;
  for (Value& point : points) setSeconds(point, secondsOf(point) + lead_s);
  if (!now.is_known) return decoded.bytes();
  const Value like = points.front();
  const std::vector<double> rest(now.positions.size());
  if (lead_s > 0) {
    if (now.reference && !now.is_at_once) {
      points.insert(points.begin(), pointAt(like, *now.reference, rest, lead_s));
    }
    const std::vector<JointWay::Rest>& rests = now.way.rests;
    for (std::size_t i = rests.size(); i-- > 2;) {  // but the first and the last
      const double share = rests[i - 1].at_s / now.way.seconds();
      points.insert(points.begin(), pointAt(like, rests[i - 1].positions, rest, share * lead_s));
    }
  } else {
    beginAlong(trajectory->joints, now, points);
    if (is_only_point) checkOnlyPoint(*trajectory, now, at);
  }
  if (!options_.controllers_join) {
    points.insert(points.begin(),
                  pointAt(like, now.positions, lead_s > 0 ? rest : now.velocities, 0));
  }
  return decoded.bytes();
}

// ------------------------------------------------------------------------------ the rest of a goal

/// The begin of the rest of a goal.
struct ArmStart::Rest {
  ArmPath path;
  ArmDeparture departure = {};
  std::vector<double> positions = {};  ///< now, as many turns on as the path
  double approach_s = 0;               ///< time to where they set off; 0: they are there
  JointWay way = {};                   ///< way by which they approach
  double behind_s = 0;    ///< the place where they set off is so much earlier than they should be

  RestNeed need() const {
    const double seconds = approach_s + behind_s + departure.lostSeconds();
    return {std::max(0.0, seconds), approach_s > 0};
  }
};

/// Empty if it is not known where the joints come from.
std::optional<ArmPath> ArmStart::pathOf(const Trajectory& trajectory,
                                        const GoalProgress& progress) const {
  std::vector<ArmKnot> knots;
  std::vector<bool> is_continuous;
  for (const Value& point : *trajectory.points) {
    knots.push_back({secondsOf(point), numbersAt(point, "positions"),
                     numbersAt(point, "velocities"), numbersAt(point, "accelerations")});
  }
  ArmKnot begin = knots.front();
  begin.at_s = 0;
  begin.velocities.assign(begin.velocities.size(), 0);
  begin.accelerations.assign(begin.accelerations.size(), 0);
  bool is_known = true;
  for (std::size_t i = 0; i < trajectory.joints.size(); ++i) {
    const std::string& joint = trajectory.joints[i];
    is_continuous.push_back(options_.robot.isEndless(joint));
    const auto reach = recorded_.around(joint, progress.begun, 0);
    is_known = is_known && reach;
    if (reach) begin.positions[i] -= wayOf(joint, reach->at, begin.positions[i]);
  }
  const bool begins_later = knots.front().at_s > kAtOnce;
  if (begins_later && !is_known && progress.elapsed_s < knots.front().at_s) {
    return std::nullopt;
  }
  if (begins_later && is_known) knots.insert(knots.begin(), begin);
  return ArmPath(std::move(knots), std::move(is_continuous));
}

/// Returns the time in which the joints become as fast as the path.
double ArmStart::rampOf(const std::vector<std::string>& joints, const Rest& rest) const {
  const ArmDeparture& by = rest.departure;
  double ramp_s = kShortestRamp;
  for (double ahead = 0; ahead <= kLooksAhead; ahead += kLookEvery) {
    const ArmKnot there = rest.path.at(by.from_s + ahead);
    for (std::size_t i = 0; i < joints.size(); ++i) {
      const double usual = options_.robot.isSliding(joints[i]) ? kSlidingStart : kTurningStart;
      const double most =
          std::min(usual, options_.limits.of(joints[i]).acceleration.value_or(usual));
      const double change = std::abs((1 - by.pace) * there.velocities[i]);
      ramp_s = std::max(ramp_s, kCubicPeak * change / most);
    }
  }
  ramp_s = std::max(std::min(ramp_s, kLongestRamp), by.blend_s / kBlendPart);
  // Joints that are ahead let the path catch up.
  const bool waits = rest.behind_s < 0 && by.pace < kWholePace;
  return waits ? std::max(ramp_s, -2 * rest.behind_s / (1 - by.pace)) : ramp_s;
}

/// Finds where on the path the joints are, how far off it, and how fast; else how they get there.
void ArmStart::findPlace(const std::vector<std::string>& joints,
                         const std::vector<LiveJoint>& live, double elapsed_s, Rest& rest) const {
  std::vector<double> tolerances;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    rest.positions.push_back(live[i].position);
    tolerances.push_back(toleranceOf(options_.robot, joints[i], options_.tolerances));
  }
  const auto found = rest.path.find(rest.positions, tolerances, elapsed_s);
  rest.departure.from_s = found.value_or(elapsed_s);
  rest.behind_s = elapsed_s - rest.departure.from_s;
  const ArmKnot there = rest.path.at(rest.departure.from_s);
  const double peak = rest.path.hasAccelerations() ? kQuinticPeak : kCubicPeak;
  double along = 0, square = 0, fastest = 0;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const double off = rest.path.way(i, there.positions[i], live[i].position);
    rest.positions[i] = there.positions[i] + off;
    const double blend = options_.robot.isSliding(joints[i]) ? kSlidingBlend : kTurningBlend;
    if (found) {
      rest.departure.offsets.push_back(off);
      rest.departure.blend_s =
          std::max(rest.departure.blend_s, kQuinticPeak * std::abs(off) / blend);
    } else {
      rest.approach_s =
          std::max({rest.approach_s, kSettle, peak * std::abs(off) / speedOf(joints[i])});
    }
    along += live[i].velocity * there.velocities[i];
    square += there.velocities[i] * there.velocities[i];
    fastest = std::max(fastest, std::abs(live[i].velocity));
  }
  const bool moves = found && fastest > kMoves && along > 0;
  rest.departure.pace = moves ? std::min(kFastestPace, along / square) : 0;
}

/// Empty if the rest is to be begun as a goal of its own.
std::optional<ArmStart::Rest> ArmStart::restOf(const Trajectory& trajectory,
                                               const GoalProgress& progress) const {
  const std::vector<std::string>& joints = trajectory.joints;
  auto path = pathOf(trajectory, progress);
  if (!path) {
    return std::nullopt;
  }
  const double elapsed_s = std::clamp(progress.elapsed_s, 0.0, std::max(0.0, path->endSeconds()));
  const ArmKnot there = path->at(elapsed_s);
  std::vector<LiveJoint> live;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const std::optional<LiveJoint> joint = liveOf(joints[i]);
    if (!joint) {
      return std::nullopt;
    }
    live.push_back(*joint);
    const auto reach = recorded_.around(joints[i], progress.at, JointTrack::kAroundNs);
    const double then = reach ? reach->at : there.positions[i];
    const double way = wayOf(joints[i], then, joint->position);
    // Throws for a joint that may not be there.
    (void)leadOf(joints[i], then, reach ? reach->off(way) : std::abs(way), joint->position);
  }
  Rest rest{*std::move(path)};
  findPlace(joints, live, elapsed_s, rest);
  if (rest.approach_s > 0) {
    const std::vector<double> to = rest.path.at(rest.departure.from_s).positions;
    rest.way = wayTo(joints, rest.positions, to, progress.at);
    rest.approach_s = std::max(rest.approach_s, rest.way.seconds());
  }
  rest.departure.ramp_s = rampOf(joints, rest);
  return rest;
}

std::optional<RestNeed> ArmStart::needToGoOn(const Channel& channel, const Bytes& goal,
                                             const GoalProgress& progress) const {
  const DecodedGoal decoded(channel, goal);
  if (!decoded.trajectory) return std::nullopt;
  if (const auto rest = restOf(*decoded.trajectory, progress)) return rest->need();
  const auto lead_s = leadOf(channel, restAlone(channel, goal, progress), progress.at);
  return lead_s ? std::optional(RestNeed{*lead_s, *lead_s > 0}) : std::nullopt;
}

Bytes ArmStart::goOn(const Channel& channel, const Bytes& goal, const GoalProgress& progress,
                     double lead_s) const {
  DecodedGoal decoded(channel, goal);
  const std::optional<Trajectory>& trajectory = decoded.trajectory;
  if (!trajectory) return goal;
  const auto rest = restOf(*trajectory, progress);
  if (!rest) {
    return begin(channel, restAlone(channel, goal, progress), progress.at, lead_s);
  }
  moved_.insert(trajectory->joints.begin(), trajectory->joints.end());
  const ArmDeparture& by = rest->departure;
  // What else goes on may need longer.
  const double spare_s = by.pace > 0 ? 0 : std::max(0.0, lead_s - rest->need().seconds);
  const double begin_s = rest->approach_s + spare_s;
  const std::vector<double> still(rest->positions.size());
  const double stands_s = begin_s > kNearest ? begin_s : 0;
  std::vector<ArmKnot> knots;
  if (stands_s > 0) knots.push_back({-stands_s, rest->positions, still, still});
  for (std::size_t i = 1; i + 1 < rest->way.rests.size(); ++i) {
    const JointWay::Rest& bend = rest->way.rests[i];
    const double share = bend.at_s / rest->way.seconds();
    knots.push_back({(share - 1) * stands_s, bend.positions, still, still});
  }
  const std::vector<ArmKnot> on_path = depart(rest->path, by);
  knots.insert(knots.end(), on_path.begin(), on_path.end());
  if (options_.controllers_join) knots.erase(knots.begin());
  Array points;
  for (const ArmKnot& knot : knots) {
    const double path_s = by.from_s + knot.at_s - by.lostSeconds();
    const auto next = std::find_if(
        trajectory->points->begin(), std::prev(trajectory->points->end()),
        [path_s](const Value& point) { return secondsOf(point) > path_s - kNearest; });
    points.push_back(pointAt(*next, rest->path, knot, knot.at_s + stands_s));
  }
  *trajectory->points = std::move(points);
  return decoded.bytes();
}

double ArmStart::headVelocity(Stamp begun, Stamp at) const {
  const Stamp end{std::max(begun.ns + kLongestLookNs, at.ns)};
  double fastest = options_.speed.of(options_.robot, "head");
  for (const std::string& joint : recorded_.names()) {
    if (joint.find("head") == std::string::npos) continue;
    const double limit = options_.limits.of(joint).velocity.value_or(
        std::numeric_limits<double>::infinity());
    fastest = std::max(fastest, std::min(limit, recorded_.fastest(joint, begun, end)));
  }
  return fastest / kQuinticPeak;
}

void ArmStart::halted() {
  halted_.clear();
  for (const std::string& joint : moved_) {
    if (const auto live = look_(joint)) halted_[joint] = live->position;
  }
}

}  // namespace afterglow::replay
