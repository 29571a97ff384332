#include "replay/motion/base/base_tracker.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace afterglow::replay {
namespace {

constexpr double kLongestStep = 0.1;  // s; a caller that was away longer has not driven,
constexpr double kTimesOut = 0.3;     // and the base has stopped by itself
constexpr double kHolonomicGain = 2;  // 1/s, in x, y and yaw
constexpr double kLeastGain = 0.6;  // 1/s, so that a base that lags comes on while the track rests
constexpr double kResting = 0.01;   // m/s, rad/s: a track slower than this rests
constexpr double kRest = 0.02;      // m and rad that a base at rest is not moved for

/// The factor on the reference's speed, and m/s beyond it, with which a base catches up.
constexpr double kCatchUp = 1.05, kCatchUpSpeed = 0.1;

/// s that a correction of the end is waited for; then the base stays where it is.
constexpr double kCorrectionPatience = 3;

// Where the path time begins to slow down, and where it is slowest.
constexpr double kLagBegin = 0.04, kLagEnd = 0.15;    // m
constexpr double kSideBegin = 0.06, kSideEnd = 0.25;  // m; only driving on takes a base sideways,
constexpr double kSlowestAside = 0.3;                 // so it never stands for that
constexpr double kTurnBegin = 0.12, kTurnEnd = 0.45;  // rad

/// Returns where the base may point at its end. A way to a place was not recorded, and has the
/// turns it needs.
HeadingRange headingsFor(const PoseTrack& track) {
  constexpr double kPlace = 0.05;  // m
  return track.begin() < track.end() ? track.headingsAtEnd(kPlace) : FinalApproach::kAnywhere;
}

double ramp(double value, double begin, double end) {
  return std::clamp((end - value) / (end - begin), 0., 1.);
}

/// An error ahead in the direction of a motion, and beside it.
struct Lag {
  double along = 0, aside = 0;
};
Lag lagOf(const PlanarPose& error, const PlanarVelocity& motion) {
  if (motion.speed() <= kResting) return {std::hypot(error.x, error.y), 0};
  const double x = motion.forward / motion.speed(), y = motion.left / motion.speed();
  return {x * error.x + y * error.y, x * error.y - y * error.x};
}

/// Returns the velocity as a base sees it that is turned by so much less.
PlanarVelocity turned(const PlanarVelocity& velocity, double yaw) {
  const double c = std::cos(yaw), s = std::sin(yaw);
  return {c * velocity.forward - s * velocity.left, velocity.turn,
          s * velocity.forward + c * velocity.left};
}

/// Returns the share of its pace that a reference keeps while the base is off by this.
double paceShare(const PlanarPose& error, const PlanarVelocity& recorded, bool is_holonomic) {
  const bool is_driven = recorded.speed() > kResting;
  Lag lag{is_driven ? std::copysign(1., recorded.forward) * error.x : std::abs(error.x), error.y};
  if (is_holonomic) lag = lagOf(error, recorded);
  const double slowest = is_holonomic ? 0 : kSlowestAside;
  return std::min(ramp(lag.along, kLagBegin, kLagEnd),
                  ramp(std::abs(error.yaw), kTurnBegin, kTurnEnd)) *
         std::max(slowest, ramp(std::abs(lag.aside), kSideBegin, kSideEnd));
}

/// Returns the pace after rest, and after whatever had slowed it down: the reference gets faster as
/// the base can.
double speedUp(double pace, const PlanarVelocity& recorded, const PlanarVelocity& led,
               const DriveLimits& limits, double seconds) {
  const auto limit = [&](double now, double ramp, double speed) {
    const double most = now + ramp * seconds;
    if (speed * pace > most) pace = most / speed;
  };
  limit(led.speed(), DriveTiming::kPlannedShare * limits.acceleration, recorded.speed());
  limit(std::abs(led.turn), limits.turn_acceleration, std::abs(recorded.turn));
  return pace;
}

PlanarVelocity holonomicLaw(const PlanarPose& error, const PlanarVelocity& wanted) {
  const PlanarVelocity seen = turned(wanted, error.yaw);
  PlanarVelocity velocity{seen.forward + kHolonomicGain * error.x,
                          seen.turn + kHolonomicGain * error.yaw,
                          seen.left + kHolonomicGain * error.y};
  // A base that is ahead waits; it does not go the other way.
  if (seen.speed() < kResting) return velocity;
  const double x = seen.forward / seen.speed(), y = seen.left / seen.speed();
  const double along = x * velocity.forward + y * velocity.left;
  if (along < 0) {
    velocity.forward -= along * x;
    velocity.left -= along * y;
  }
  return velocity;
}

PlanarVelocity unicycleLaw(const PlanarPose& error, const PlanarVelocity& wanted,
                           const TrackerOptions& options) {
  const double frequency = std::max(
      kLeastGain,
      std::sqrt(wanted.turn * wanted.turn + options.stiffness * wanted.forward * wanted.forward));
  const double gain = 2 * options.damping * frequency;
  const double sinc = std::abs(error.yaw) < 1e-6 ? 1 : std::sin(error.yaw) / error.yaw;
  double forward = wanted.forward * std::cos(error.yaw) + gain * error.x;
  // A base that is ahead waits; it does not drive the other way.
  if (std::abs(wanted.forward) >= kResting && forward * wanted.forward < 0) forward = 0;
  return {forward,
          wanted.turn + options.stiffness * wanted.forward * sinc * error.y + gain * error.yaw};
}

}  // namespace

BasePlace::BasePlace(const PoseTrack& track, const TrackerOptions& options,
                     std::optional<BaseLocalizer> known)
    : T_track_start_(track.startPose()),
      noise_(options.noise),
      is_localized_(track.isLocalized() && options.with_localization),
      localizer_(std::move(known)) {}

std::string BasePlace::whyUnknown(const BaseInput& input) {
  if (!input.T_odom_base) return "no odometry";
  odometry_watch_.heard(input.T_odom_base->stamp);
  if (odometry_watch_.isOverdue(input.now)) {
    return fmt::format("no odometry for {:.1f} s", odometry_watch_.silence(input.now));
  }
  if (!is_localized_) return "";
  if (!input.T_map_odom) return "no localization";
  localization_watch_.heard(input.T_map_odom->stamp);
  if (localization_watch_.isOverdue(input.now)) {
    return fmt::format("no localization for {:.1f} s", localization_watch_.silence(input.now));
  }
  return "";
}

void BasePlace::take(const BaseInput& input) {
  odometry_ = input.T_odom_base->pose;
  if (!localizer_) {
    const PlanarPose T_track_odom =
        is_localized_ ? input.T_map_odom->pose : compose(T_track_start_, inverse(odometry_));
    localizer_.emplace(noise_, T_track_odom, odometry_, input.now);
  }
  localizer_->move(odometry_);
  if (is_localized_) localizer_->correct(input.T_map_odom->pose, input.T_map_odom->stamp);
}

void BasePlace::beginDrift() {
  if (!T_map_odom_at_start_) T_map_odom_at_start_ = compose(localizer_->pose(), inverse(odometry_));
}

void BasePlace::addTo(BaseReport& report, const PoseTrack& track) const {
  if (!localizer_) return;
  const PlanarPose base = localizer_->pose();
  report.end_distance = distance(base, track.endPose());
  report.end_turn = std::abs(wrapAngle(base.yaw - track.endPose().yaw));
  if (is_localized_) {
    const PoseError error = combined(localizer_->error(track.measured_error), track.end_error);
    report.end_doubt = {2 * error.position, 2 * error.yaw};
    report.gone_since_localized = localizer_->goneSinceCorrection();
  }
  if (T_map_odom_at_start_) {
    const PlanarPose by_odometry = compose(*T_map_odom_at_start_, odometry_);
    report.drift_distance = distance(by_odometry, base);
    report.drift_turn = std::abs(wrapAngle(by_odometry.yaw - base.yaw));
  }
}

BaseTracker::BaseTracker(PoseTrack track, const TrackerOptions& options,
                         std::optional<BaseLocalizer> known)
    : track_(std::move(track)),
      options_(options),
      place_(track_, options, std::move(known)),
      approach_(track_.endPose(), options.approach, headingsFor(track_), options.is_holonomic),
      path_(track_.begin(), track_.end(), options.rate),
      timing_(track_, options, options.rate),
      command_(
          {options, options.command_delay, 1e-9 * static_cast<double>(kMotionSilence.longest)}) {
  if (options.obstacles) obstacles_.emplace(*options.obstacles, track_.frame());
}

PlanarVelocity BaseTracker::update(const BaseInput& input) {
  const double since = last_update_ ? secondsBetween(*last_update_, input.now) : 0;
  const double seconds = std::clamp(since, 0., kLongestStep);
  last_update_ = input.now;
  if (since > kTimesOut || since < 0) halt(input.now);
  if (state_ == BaseState::Done || state_ == BaseState::Lost) return halt(input.now);
  taken_ += seconds;
  reason_ = place_.whyUnknown(input);
  if (!reason_.empty()) {
    report_.waited += seconds;
    idle(seconds, reason_);
    return halt(input.now);
  }
  place_.take(input);
  const PlanarPose base = command_.predict(place_.localizer()->pose(), input.T_odom_base->stamp,
                                           later(input.now, options_.command_delay));
  if (obstacles_) {
    obstacles_->move(input.T_odom_base->stamp, place_.odometry());
    obstacles_->hear(input.scan);
    const double radius = obstacles_->options().footprint.radius();
    if (state_ == BaseState::Following &&
        !mayGoOn(base,
                 pathAlong(track_, path_.now(), base, radius, obstacles_->lookAhead(),
                           options_.is_holonomic),
                 input.now, seconds)) {
      return halt(input.now);
    }
  }
  const PlanarVelocity wanted = state_ == BaseState::Following
                                    ? follow(base, seconds)
                                    : approach(base, is_barred_ ? 0 : seconds);
  if (state_ == BaseState::Approaching && obstacles_ && !wanted.isZero()) {
    const ObstacleStop& stop = *obstacles_;
    const double radius = stop.options().footprint.radius();
    if (!mayGoOn(base, pathOf(wanted, radius, stop.lookAhead()), input.now, seconds)) {
      return halt(input.now);
    }
  }
  if (state_ == BaseState::Lost) return halt(input.now);
  return send(wanted, input.now, seconds);
}

void BaseTracker::setRate(double rate) {
  if (rate == path_.rate()) return;
  timing_ = DriveTiming(track_, options_, rate);
  path_.setRate(rate);
}

void BaseTracker::rest() {
  if (obstacles_) obstacles_->rest();
  if (last_update_) halt(*last_update_);
}

bool BaseTracker::isOnTime() const {
  return state_ == BaseState::Following && reason_.empty() && path_.pace() > 0.999 * path_.rate();
}

PlanarVelocity BaseTracker::follow(const PlanarPose& base, double seconds) {
  path_.advance(seconds);
  if (path_.isAtEnd()) {
    state_ = BaseState::Approaching;
    report_.delay = taken_ - secondsBetween(track_.begin(), track_.end()) / path_.rate();
    return {};
  }
  const Stamp reference = path_.in(options_.command_delay);
  const PlanarPose error = between(base, track_.at(reference));
  if (isOff(error)) return {};
  PlanarVelocity recorded = track_.velocityAt(reference);
  if (!options_.is_holonomic) recorded.left = 0;
  if (hasStrayed(error, recorded)) return {};
  double pace = timing_.paceAt(reference) * paceShare(error, recorded, options_.is_holonomic);
  if (pace < 0.05 * path_.rate()) {
    idle(seconds,
         fmt::format("the base does not follow: {:.2f} m and {:.0f} deg behind",
                     std::hypot(error.x, error.y), std::abs(error.yaw) * kDegreesPerRadian));
  } else {
    idle_ = 0;
  }
  if (obstacles_) {
    const double rim = rimSpeed(recorded, obstacles_->options().footprint.radius());
    if (rim * pace > fastest_) pace = fastest_ / rim;
  }
  pace = speedUp(pace, recorded, led_, options_, seconds);
  path_.setPace(pace);
  led_ = {recorded.forward * pace, recorded.turn * pace, recorded.left * pace};
  return withinReach(law(error, led_), error, reference);
}

/// A base that catches up must still come to rest where the reference does.
PlanarVelocity BaseTracker::withinReach(PlanarVelocity wanted, const PlanarPose& error,
                                        Stamp reference) const {
  const double speed = wanted.speed();
  if (speed == 0) return wanted;
  const double behind = (wanted.forward * error.x + wanted.left * error.y) / speed;
  const double most = std::min({kCatchUp * led_.speed() + kCatchUpSpeed,
                                std::max(kCatchUp * timing_.fastest(), kCatchUpSpeed),
                                timing_.speedFor(timing_.wayToRest(reference) + behind)});
  if (speed <= most) return wanted;
  return {wanted.forward * most / speed, wanted.turn, wanted.left * most / speed};
}

/// Returns true if the scan sees the way free.
bool BaseTracker::mayGoOn(const PlanarPose& base, const SweptPath& path, Stamp now,
                          double seconds) {
  using Kind = ObstacleStop::Verdict::Kind;
  const PlanarPose T_odom_base = compose(place_.odometry(), between(localizer()->pose(), base));
  const double radius = obstacles_->options().footprint.radius();
  const PlanarVelocity& sent = command_.velocity();
  const ObstacleStop::Verdict verdict = obstacles_->judge(
      {now, T_odom_base, base, path_.now(), seconds}, path,
      pathOf(sent, radius, obstacles_->wayToStop(rimSpeed(sent, radius))));
  // After a wait it gets faster as it would from any stand.
  fastest_ = std::min(verdict.speed, fastest_ + options_.acceleration * seconds);
  is_barred_ = verdict.kind != Kind::Go;
  if (!is_barred_) return true;
  reason_ = verdict.reason;
  const bool is_correction =
      state_ == BaseState::Approaching && track_.begin() < track_.end();
  if (is_correction && verdict.waited > kCorrectionPatience) {
    state_ = BaseState::Done;
  } else if (verdict.kind == Kind::GiveUp) {
    state_ = BaseState::Lost;
  }
  return false;
}

/// A way that was not recorded, as to a place, or back by a base that somebody pushed ahead, is not
/// driven where nobody looks. A base that is not holonomic goes ahead or back.
bool BaseTracker::mayGo(const PlanarPose& way) const {
  if (!obstacles_ || way.x * way_.forward + way.y * way_.left > 0) return true;
  const double far = 2 * obstacles_->options().footprint.radius();
  const double length = std::hypot(way.x, way.y);
  if (!options_.is_holonomic || length == 0) return obstacles_->sees({std::copysign(far, way.x), 0});
  return obstacles_->sees({far * way.x / length, far * way.y / length});
}

PlanarVelocity BaseTracker::law(const PlanarPose& error, const PlanarVelocity& wanted) const {
  const bool is_resting = wanted.speed() < kResting && std::abs(wanted.turn) < kResting;
  const double off = options_.is_holonomic ? std::hypot(error.x, error.y) : std::abs(error.x);
  if (is_resting && off < std::max(kRest, 3 * localizer()->positionError()) &&
      std::abs(error.yaw) < std::max(kRest, 3 * localizer()->yawError())) {
    return {};
  }
  return options_.is_holonomic ? holonomicLaw(error, wanted) : unicycleLaw(error, wanted, options_);
}

PlanarVelocity BaseTracker::approach(const PlanarPose& base, double seconds) {
  idle_ = 0;
  report_.approach += seconds;
  PlanarPose error = between(base, track_.endPose());
  error.yaw = 0;  // it may have turned away on purpose
  if (isOff(error)) return {};
  approach_.avoidUnseen(
      !mayGo(options_.is_holonomic ? between(base, track_.endPose()) : PlanarPose{-1, 0, 0}));
  const auto wanted = place_.isLocalized() ? approach_.step(base, localizer()->positionError(),
                                                            localizer()->yawError(), seconds)
                                           : approach_.step(base, 0, 0, seconds);
  if (wanted) return *wanted;
  state_ = BaseState::Done;
  return {};
}

/// Keeps the largest deviations of the way; too large a one is the end.
bool BaseTracker::isOff(const PlanarPose& error) {
  const double off = std::hypot(error.x, error.y), turned = std::abs(error.yaw);
  if (state_ == BaseState::Following) {
    deviation_ = off;
    report_.largest_distance = std::max(report_.largest_distance, off);
    report_.largest_turn = std::max(report_.largest_turn, turned);
  }
  if (off <= options_.lost_distance && turned <= options_.lost_turn) return false;
  state_ = BaseState::Lost;
  reason_ = fmt::format("the base is {:.2f} m and {:.0f} deg off its track", off,
                        turned * kDegreesPerRadian);
  return true;
}

/// Returns true if the base has strayed; where the track rests, a base that was pushed is not
/// brought back where nobody looks.
bool BaseTracker::hasStrayed(const PlanarPose& error, const PlanarVelocity& recorded) {
  if (recorded.speed() > kResting) {
    way_ = recorded;
    return false;
  }
  const double off = options_.is_holonomic ? std::hypot(error.x, error.y) : std::abs(error.x);
  const double borne = std::max(FinalApproach::kUnseenWay, 3 * localizer()->positionError());
  if (off <= borne || mayGo(error)) return false;
  state_ = BaseState::Lost;
  reason_ = fmt::format("the base is {:.2f} m off its track, on a way back that nobody sees", off);
  return true;
}

void BaseTracker::idle(double seconds, const std::string& why) {
  idle_ += seconds;
  if (idle_ <= options_.patience) return;
  state_ = BaseState::Lost;
  reason_ = why;
}

PlanarVelocity BaseTracker::send(const PlanarVelocity& wanted, Stamp now, double seconds) {
  command_.change(wanted, seconds);
  if (obstacles_) {
    const double rim = rimSpeed(command_.velocity(), obstacles_->options().footprint.radius());
    if (rim > fastest_) command_.slow(fastest_ / rim);
  }
  if (command_.isMoving()) place_.beginDrift();
  return command_.send(now);
}

PlanarVelocity BaseTracker::halt(Stamp now) {
  led_ = {};
  command_.halt();
  return command_.send(now);
}

BaseReport BaseTracker::report() const {
  BaseReport report = report_;
  report.corrections = approach_.attempts();
  if (obstacles_) report.obstacles = obstacles_->report();
  place_.addTo(report, track_);
  if (localizer() && approach_.isLeftAside()) {
    report.left_aside = std::abs(between(track_.endPose(), localizer()->pose()).y);
  }
  return report;
}

}  // namespace afterglow::replay
