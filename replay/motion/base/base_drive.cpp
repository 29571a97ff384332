#include "replay/motion/base/base_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "replay/motion/planar_pose.hpp"

namespace afterglow::replay {
namespace {

constexpr Stamp kNever{std::numeric_limits<std::int64_t>::max()};
/// The time that the timeline may be ahead, in s: of a base that keeps up, so that a late step does
/// not make it stumble, and of a base that lags behind.
constexpr double kStepsAhead = 0.06, kStepAhead = 0.02;
/// A stop of less than so many s is passed with this tolerance, m and rad.
constexpr double kShortStop = 3, kPassing = 0.03;
/// A base that ends farther from its end has not got there: m, rad.
constexpr double kEndError = 0.05, kEndTurn = 0.09;
/// A base that moved less than that between two stands was shaken, not driven: m, rad.
constexpr double kShaken = 0.01, kTurnShaken = 0.02;

/// Returns true if the base gets farther from where it begins than a shaken base.
bool isDriven(const PoseTrack& drive) {
  const PlanarPose begin = drive.startPose();
  for (Stamp at = drive.begin(); at < drive.end(); at = later(at, 0.1)) {
    const PlanarPose pose = drive.at(std::min(at, drive.end()));
    if (distance(begin, pose) > kShaken || std::abs(wrapAngle(pose.yaw - begin.yaw)) > kTurnShaken)
      return true;
  }
  return distance(begin, drive.endPose()) > kShaken;
}

}  // namespace

BaseDrive::BaseDrive(std::string topic, Bytes sample, const PoseTrack& track, Stamp begin,
                     Stamp end, const TrackerOptions& options, Look look)
    : topic_(std::move(topic)),
      sample_(std::move(sample)),
      track_(track),
      options_(options),
      look_(std::move(look)),
      limit_(kNever) {
  if (sample_.size() < sizeof(Velocity)) {
    throw std::invalid_argument("a message on " + topic_ + " has no velocity");
  }
  (void)BaseTracker(track.part(begin, begin), options);  // looks at the limits
  findDrives(std::max(begin, track.begin()), std::min(end, track.end()));
  report_.topic = topic_;
  report_.frame = track.frame();
  report_.is_localized = track.isLocalized() && options.with_localization;
  for (const Drive& drive : drives_) report_.length += track.part(drive.begin, drive.end).length();
}

void BaseDrive::findDrives(Stamp begin, Stamp end) {
  const auto add = [this](Stamp from, Stamp to, bool is_passing) {
    if (from < to && isDriven(track_.part(from, to))) drives_.push_back({from, to, is_passing});
  };
  Stamp from = begin;
  for (const TrackSpan& stand : track_.stands) {
    const bool is_last = stand.to >= track_.end() || stand.to >= end;
    add(from, std::min(stand.from, end),
        !is_last && secondsBetween(stand.from, stand.to) < kShortStop);
    from = std::max(from, stand.to);
  }
  add(from, end, false);
}

std::vector<BaseDrive::Timing> BaseDrive::timings(double rate) const {
  std::vector<Timing> timings;
  for (const Drive& drive : drives_) {
    const DriveTiming timing(track_.part(drive.begin, drive.end), options_, rate);
    timings.push_back({drive.begin, drive.end, timing.seconds()});
  }
  return timings;
}

void BaseDrive::enter(Stamp at) {
  if (tracker_ && !is_return_) report_.drives.push_back(current());
  if (tracker_ && tracker_->localizer()) known_ = tracker_->localizer();
  // Localization sees what was done to the base meanwhile; odometry is all there is otherwise.
  if (report_.is_localized) known_.reset();
  tracker_.reset();
  failure_.clear();
  next_ = 0;
  while (next_ < drives_.size() && drives_[next_].end <= at) ++next_;
  // The part of a drive before it is not driven any more; the rest begins there.
  begin_ = at;
  is_return_ = std::exchange(has_entered_, true);
  if (is_return_) {
    start(at, at);
  } else if (!report_.is_localized) {
    rememberStart(at);
  }
  limit_ = nextBegin();
}

/// Odometry has to know where it began, also if the replay is moved before the first drive.
void BaseDrive::rememberStart(Stamp at) {
  const BaseInput now = look_({});
  if (!now.T_odom_base) return;
  const PlanarPose& odometry = now.T_odom_base->pose;
  known_.emplace(options_.noise, compose(track_.at(at), inverse(odometry)), odometry, now.now);
}

bool BaseDrive::isBusy(Stamp at) const { return at >= nextBegin(); }

Stamp BaseDrive::nextBegin() const {
  if (!failure_.empty()) return kNever;
  if (tracker_) return tracker_->track().begin();
  return next_ < drives_.size() ? std::max(begin_, drives_[next_].begin) : kNever;
}

void BaseDrive::start(Stamp from, Stamp to) {
  if (tracker_ && tracker_->localizer()) known_ = tracker_->localizer();
  TrackerOptions options = options_;
  if (isPassing()) {
    options.approach.tolerance = options.approach.turn_tolerance = kPassing;
    options.approach.longest_stand = options.approach.shortest_stand;
    options.approach.most_attempts = 1;
  }
  tracker_ = std::make_unique<BaseTracker>(track_.part(from, to), options, known_);
}

BaseDrive::Step BaseDrive::step(Stamp at, bool is_held, double rate, Stamp ros_now) {
  if (!isBusy(at)) return {{}, limit_};
  if (!tracker_) start(nextBegin(), drives_[next_].end);
  Step step = follow(at, is_held, rate, ros_now);
  if (tracker_->state() == BaseState::Lost) failure_ = tracker_->reason();
  if (tracker_->state() == BaseState::Done) failure_ = whyNotThere();
  const bool is_over = tracker_->state() == BaseState::Done || tracker_->state() == BaseState::Lost;
  if (is_over) finish();
  step.limit = limit_ = is_over ? nextBegin() : step.limit;
  return step;
}

BaseDrive::Step BaseDrive::follow(Stamp at, bool is_held, double rate, Stamp ros_now) {
  tracker_->setRate(rate);
  if (is_held && tracker_->state() == BaseState::Following && tracker_->progress() >= at) {
    tracker_->rest();
    return {PlanarVelocity{}, limit_};
  }
  tracker_->setLimit(is_held ? at : later(at, kStepsAhead * rate));
  tracker_->meet(at);
  const PlanarVelocity command = tracker_->update(look_(ros_now));
  const double ahead = tracker_->isOnTime() ? kStepsAhead : kStepAhead;
  return {command, std::min(later(tracker_->progress(), ahead * rate), tracker_->track().end())};
}

std::string BaseDrive::whyNotThere() const {
  if (isPassing()) return "";
  const BaseReport base = tracker_->report();
  const bool is_there = base.end_distance <= kEndError + base.end_doubt.position &&
                        base.end_turn <= kEndTurn + base.end_doubt.yaw;
  return is_there ? ""
                  : fmt::format("it stands {:.2f} m and {:.0f} deg from where it had stood",
                                base.end_distance, base.end_turn * kDegreesPerRadian);
}

void BaseDrive::finish() {
  if (!is_return_ || !failure_.empty()) report_.drives.push_back(current());
  known_ = tracker_->localizer();
  tracker_.reset();
  if (!std::exchange(is_return_, false)) ++next_;
}

void BaseDrive::rest() {
  if (tracker_) tracker_->rest();
}

std::string BaseDrive::reason() const { return tracker_ ? tracker_->reason() : std::string(); }

std::optional<Stamp> BaseDrive::progress() const {
  return tracker_ && !is_return_ ? std::optional(tracker_->progress()) : std::nullopt;
}

std::optional<double> BaseDrive::deviation() const {
  const bool follows = tracker_ && !is_return_ && tracker_->state() == BaseState::Following;
  return follows ? std::optional(tracker_->deviation()) : std::nullopt;
}

Bytes BaseDrive::message(const PlanarVelocity& command, Stamp now) const {
  return velocityMessage(sample_, command, now);
}

DriveReport BaseDrive::current() const {
  return {tracker_->track().begin(), tracker_->track().end(), tracker_->state(),
          tracker_->report()};
}

BaseDriveReport BaseDrive::report() const {
  BaseDriveReport report = report_;
  if (tracker_ && !is_return_) report.drives.push_back(current());
  report.lost = failure_;
  for (const DriveReport& drive : report.drives) {
    report.delay += drive.base.delay + drive.base.approach;
    report.waited += drive.base.waited;
    const ObstacleReport& obstacles = drive.base.obstacles;
    report.obstacles.waited += obstacles.waited;
    report.obstacles.unseen += obstacles.unseen;
    report.obstacles.waits.insert(report.obstacles.waits.end(), obstacles.waits.begin(),
                                  obstacles.waits.end());
  }
  return report;
}

}  // namespace afterglow::replay
