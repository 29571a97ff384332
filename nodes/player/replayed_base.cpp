#include "nodes/player/replayed_base.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <utility>

#include "nodes/player/ros_clock.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::chrono::milliseconds kBaseStep(20);
constexpr double kPosesPatience = 3;    // s
constexpr double kLongestDrive = 60;    // s

std::vector<const replay::PlannedTopic*> velocityTopics(const replay::PlayPlan& plan) {
  std::vector<const replay::PlannedTopic*> topics;
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (topic.isPlayed() && isVelocity(topic.channel) && topic.count > 0) topics.push_back(&topic);
  }
  return topics;
}

/// Tells how long the base waited, for what and where, a sentence each.
void tellObstacles(const replay::ObstacleReport& obstacles, const std::string& frame,
                   const std::optional<replay::Stamp>& begin, std::vector<std::string>& notes) {
  for (const replay::ObstacleWait& wait : obstacles.waits) {
    const std::string what =
        std::isfinite(wait.distance)
            ? fmt::format("something {:.2f} m from it, at ({:.2f}, {:.2f}) in {}",
                          std::max(0., wait.distance), wait.place.x, wait.place.y, frame)
            : "a scan";
    const std::string where =
        begin ? fmt::format(", {:.1f} s into the behavior", secondsBetween(*begin, wait.at)) : "";
    notes.push_back(fmt::format("the base waited {:.1f} s for {}{}", wait.seconds, what, where));
  }
  if (obstacles.unseen > 0.01) {
    notes.push_back(fmt::format(
        "the base drove {:.2f} m where the scan does not look: as it was recorded, and slowly",
        obstacles.unseen));
  }
}

/// Tells where the last centimeters were left, a sentence each.
void tellLeftAside(const replay::BaseDriveReport& driven, std::vector<std::string>& notes) {
  constexpr double kTold = 0.001;  // m
  for (const replay::DriveReport& drive : driven.drives) {
    if (drive.base.left_aside < kTold) continue;
    notes.push_back(fmt::format(
        "the base was left {:.1f} cm beside where it had stood: it was not recorded to turn there",
        drive.base.left_aside * 100));
  }
}

/// Returns the base's topic among all that play velocities; nullptr: it is not known.
const replay::PlannedTopic* chooseTopic(const std::vector<const replay::PlannedTopic*>& all,
                                        const BaseOptions& options,
                                        const std::string& played_topics) {
  const bool is_said = !options.topic.empty();
  if (!is_said && all.size() == 1) return all.front();
  const std::string& wanted = is_said ? options.topic : options.usual_topic;
  for (const replay::PlannedTopic* topic : all) {
    if (wanted == topic->channel.topic || wanted == topic->output.topic) return topic;
  }
  if (!is_said) return nullptr;
  throw std::runtime_error("no velocities are played on " + options.topic +
                           ", the base's topic; there are " + played_topics);
}

std::string cannotFollow(const std::string& why) {
  return "the base cannot follow its recorded poses: " + why +
         "; --open-loop (~open_loop) sends its recorded velocities, wherever they lead";
}

}  // namespace

replay::TrackFrames liveFrames(const BaseOptions& options, const replay::PlayPlan& plan) {
  const auto& settings = plan.rewriting;
  const replay::TrackFrames& recorded = options.frames;
  return {settings.frame(recorded.map), settings.frame(recorded.odometry),
          settings.frame(recorded.base), options.tf_topic};
}

RecordedDrive::RecordedDrive(const replay::Store& store, const replay::PlayPlan& plan,
                             const BaseOptions& options) {
  const std::vector<const replay::PlannedTopic*> all = velocityTopics(plan);
  for (const replay::PlannedTopic* played : all) {
    played_topics += (played_topics.empty() ? "" : ", ") + played->channel.topic;
  }
  for (const replay::PlannedTopic& planned : plan.topics) {
    if (!planned.is_for_start) continue;
    is_for_start = true;
    topic = &planned;
    sample.resize(sizeof(replay::Velocity));
    return;
  }
  topic = chooseTopic(all, options, played_topics);
  readVelocities(store, plan);
  if (options.is_open_loop) {
    why_open_loop = "that was asked for";
  } else if (all.empty()) {
    why_not = "a drive that steers is led along no track";
  } else if (!first_motion) {
    why_open_loop = "its recorded velocities are zeros";
  } else if (!topic) {
    why_not = "velocities are played on " + played_topics +
              ", and it was not said which are the base's (--base-topic, ~base_topic)";
  } else if (options.has_recorded_time) {
    why_not = "the recording's time is played, which the robot's poses do not keep";
  } else {
    track = readPoseTrack(store, plan.behavior, options.frames, options.noise, why_not);
    if (!track) return;
    why_not = track->isLocalized() || options.is_odometry_enough
                  ? whyIncomplete(*track, *first_motion, *last_motion)
                  : "it was recorded without localization (" + options.frames.map + " -> " +
                        options.frames.odometry +
                        "); --odometry-only follows its odometry, from where it is";
  }
}

/// Reads the velocities of all played topics: until the base's topics are known, every one counts.
void RecordedDrive::readVelocities(const replay::Store& store, const replay::PlayPlan& plan) {
  for (const replay::PlannedTopic* played : velocityTopics(plan)) {
    if (topic && played != topic) continue;
    const auto messages =
        store.messages(plan.behavior, {{played->channel.topic}, plan.begin, plan.end});
    while (const auto message = messages->next()) {
      if (sample.empty()) sample = message->bytes;
      if (replay::isZero(replay::velocityOf(message->bytes))) continue;
      if (!first_motion) first_motion = message->received;
      first_motion = std::min(*first_motion, message->received);
      last_motion = std::max(last_motion.value_or(message->received), message->received);
    }
  }
  if (!topic || sample.empty()) return;
  replay::Rewriter rewriter([] { return std::string(); }, plan.rewriting);
  (void)rewriter.rewrite(topic->channel, {}, sample);
}

ReplayedBase::ReplayedBase(const replay::Store& store, const replay::PlayPlan& plan,
                           const BaseOptions& options, const replay::MotionLimits& limits)
    : plan_(plan),
      options_(options),
      limits_(limits),
      live_frames_(liveFrames(options, plan)),
      recorded_(store, plan, options) {}

std::string ReplayedBase::missingNow(const std::function<bool()>& is_stopped) {
  const bool is_localized = recorded_.track->isLocalized();
  const replay::BaseInput live = poses_->wait(is_localized, kPosesPatience, is_stopped);
  if (!live.T_odom_base) {
    return "nobody tells where it is now (tf's " + live_frames_.odometry + " -> " +
           live_frames_.base + ")";
  }
  is_on_odometry_alone_ = !is_localized || !live.T_map_odom;
  if (is_localized && !live.T_map_odom && !options_.is_odometry_enough) {
    return "nobody localizes it now (tf's " + live_frames_.map + " -> " + live_frames_.odometry +
           "); --odometry-only follows its odometry, from where it is";
  }
  return "";
}

std::string ReplayedBase::recordedRefusal() const {
  if (!recorded_.why_open_loop.empty()) return "";
  if (!recorded_.why_not.empty()) return cannotFollow(recorded_.why_not);
  const std::vector<std::string> slowed =
      options_.keeps_rate ? slowedDrives() : std::vector<std::string>();
  return slowed.empty() ? "" : slowed.front() + "; without --keep-rate the rest waits for it";
}

std::string ReplayedBase::refusal(const std::function<bool()>& is_stopped) {
  poses_.emplace(live_frames_);
  if (recorded_.is_for_start || !recorded_.why_open_loop.empty()) return "";
  if (const std::string why = recordedRefusal(); !why.empty()) return why;
  const std::string why = missingNow(is_stopped);
  return why.empty() || is_stopped() ? "" : cannotFollow(why);
}

replay::TrackerOptions ReplayedBase::trackerOptions() const {
  replay::TrackerOptions options;
  options.noise = options_.noise;
  if (limits_.linear) options.speed = std::min(options.speed, *limits_.linear);
  if (limits_.angular) options.turn_speed = std::min(options.turn_speed, *limits_.angular);
  const replay::DriveLimits shown = recorded_.track ? shownBy(*recorded_.track) : options;
  options.acceleration = limits_.linear_acceleration.value_or(
      std::min(options.acceleration, shown.acceleration));
  options.turn_acceleration = limits_.angular_acceleration.value_or(
      std::min(options.turn_acceleration, shown.turn_acceleration));
  options.obstacles = obstacles();
  options.is_holonomic = options_.is_holonomic;
  return options;
}

std::vector<std::string> ReplayedBase::slowedDrives() const {
  constexpr double kTold = 0.25;  // s
  if (!recorded_.track || !recorded_.why_not.empty()) return {};
  std::vector<std::string> slowed;
  const replay::BaseDrive drive(recorded_.topic->channel.topic, recorded_.sample, *recorded_.track,
                                plan_.begin, plan_.end, trackerOptions(), {});
  for (const replay::BaseDrive::Timing& timing : drive.timings(options_.rate)) {
    const double wanted = secondsBetween(timing.begin, timing.end) / options_.rate;
    if (timing.seconds - wanted < kTold) continue;
    slowed.push_back(fmt::format(
        "the drive at {:.1f} s takes {:.1f} s instead of {:.1f} s, as the base may not be faster",
        secondsBetween(plan_.behavior.begin, timing.begin), timing.seconds, wanted));
  }
  return slowed;
}

// ------------------------------------------------------------------------------- what it looks at

std::string ReplayedBase::scanRefusal() const {
  const ScanOptions& scan = options_.scan;
  if (scan.is_waived) return "";
  for (const replay::PlannedTopic& topic : plan_.topics) {
    const bool is_steered = topic.isPlayed() && topic.count > 0 &&
                            stopOf(topic).kind == replay::StopKind::Speed;
    if (!is_steered) continue;
    return "nothing looks where " + topic.output.topic +
           " leads the base, whose steering is not known: --no-scan (~no_scan) drives it all the "
           "same";
  }
  if (!scan.topic.empty() || !recorded_.first_motion)
    return "";  // without the latter it only hears zeros
  return "nothing sees what stands in the base's way: --scan TOPIC (~scan) or a robot's profile "
         "(--robot), else --no-scan";
}

std::string ReplayedBase::checkScan(const std::function<bool()>& is_stopped,
                                    std::function<void(const std::string&)> on_wait) {
  on_wait_ = std::move(on_wait);
  const ScanOptions& scan = options_.scan;
  if (scan.is_waived) {
    notes_.push_back("nothing saw what stood in the base's way (--no-scan, ~no_scan)");
    return "";
  }
  const std::string why_not = scanRefusal();
  if (!why_not.empty() || scan.topic.empty()) return why_not;
  scan_ = std::make_unique<LiveScan>(scan.topic, live_frames_.base, scan.footprint, options_.robot);
  if (!scan.footprint) {
    notes_.push_back(fmt::format(
        "the base's footprint is not known (--footprint, --robot): {:.1f} m around its middle "
        "were kept free",
        scan.obstacles.footprint.radius()));
  }
  return scan_->check(is_stopped);
}

std::optional<replay::ObstacleOptions> ReplayedBase::obstacles() const {
  if (!scan_) return {};
  replay::ObstacleOptions obstacles = options_.scan.obstacles;
  if (options_.scan.footprint) obstacles.footprint = *options_.scan.footprint;
  return obstacles;
}

replay::BaseInput ReplayedBase::look() {
  if (drive_) tellWait(drive_->reason());
  replay::BaseInput input = poses_->look(stampNow());
  if (scan_) input.scan = scan_->look();
  return input;
}

void ReplayedBase::tellWait(const std::string& reason) {
  if (reason == told_wait_) return;
  if (told_wait_.empty()) ROS_WARN_STREAM("the base waits: " << reason);
  if (reason.empty()) ROS_INFO("the base goes on");
  told_wait_ = reason;
  if (on_wait_) on_wait_(reason);
}

// ------------------------------------------------------------------------------ before the replay

std::optional<replay::PlanarPose> ReplayedBase::measure(double seconds,
                                                        const std::function<bool()>& is_stopped) {
  replay::BaseInput input = poses_->wait(true, kPosesPatience, is_stopped);
  if (!input.T_odom_base || !input.T_map_odom) return {};
  replay::BaseLocalizer localizer(options_.noise, input.T_map_odom->pose, input.T_odom_base->pose,
                                  input.T_map_odom->stamp);
  const RobotPatience patience(seconds);
  while (!patience.isOver() && !is_stopped()) {
    std::this_thread::sleep_for(kBaseStep);
    input = poses_->look(stampNow());
    localizer.move(input.T_odom_base->pose);
    localizer.correct(input.T_map_odom->pose, input.T_map_odom->stamp);
  }
  share_now_ = localizer.error({1, 1});
  return localizer.pose();
}

replay::PoseError ReplayedBase::startDoubt(const replay::PoseError& share_then) const {
  if (!recorded_.track) return {};
  const replay::PoseError share = combined(share_then, share_now_),
                          &one = recorded_.track->measured_error;
  return {2 * one.position * share.position, 2 * one.yaw * share.yaw};
}

std::string ReplayedBase::driveTo(const replay::PlanarPose& pose, GuardedSink& sink,
                                  const std::function<bool()>& is_stopped) {
  if (!recorded_.topic || recorded_.sample.size() < sizeof(replay::Velocity))
    return recorded_.why_open_loop;
  if (!scan_ && !options_.scan.is_waived) return "nothing sees what stands in its way (--scan)";
  const replay::PoseTrack goal({{stampNow(), pose}}, live_frames_.map, true);
  replay::TrackerOptions options = trackerOptions();
  options.lost_distance = kFarthestStart;
  options.approach = replay::approachOfStart();
  replay::BaseTracker tracker(goal, options);
  const auto send = [&](const replay::PlanarVelocity& velocity) {
    sink.publish(recorded_.topic->output,
                 replay::velocityMessage(recorded_.sample, velocity, rosStampNow()));
  };
  sink.clock().watchThisThread();
  const RobotPatience patience(kLongestDrive);
  const auto isUnderWay = [&] {
    return tracker.state() != replay::BaseState::Done && tracker.state() != replay::BaseState::Lost;
  };
  while (isUnderWay() && !is_stopped() && !patience.isOver()) {
    try {
      send(tracker.update(look()));
      tellWait(tracker.reason());
    } catch (...) {  // without the watchdog nothing is sent but a zero
      send({});
      throw;
    }
    std::this_thread::sleep_for(kBaseStep);
    sink.clock().beatIfDue();
  }
  send({});
  tellWait("");
  tellObstacles(tracker.report().obstacles, live_frames_.map, {}, notes_);
  if (is_stopped() || tracker.state() == replay::BaseState::Done) return "";
  return isUnderWay() ? "driving there took too long" : tracker.reason();
}

// ------------------------------------------------------------------------------------- the drives

void ReplayedBase::prepare(const std::function<bool()>& is_stopped) {
  if (!recorded_.track) return;
  const replay::BaseInput live =
      poses_->wait(recorded_.track->isLocalized(), kPosesPatience, is_stopped);
  replay::TrackerOptions options = trackerOptions();
  options.with_localization = live.T_map_odom.has_value();
  auto drive =
      std::make_unique<replay::BaseDrive>(recorded_.topic->channel.topic, recorded_.sample,
                                          *recorded_.track, plan_.begin, plan_.end, options,
                                          // Not the player's time: poses are dated by stampNow().
                                          [this](replay::Stamp) { return look(); });
  if (!drive->hasDrives()) {
    notes_.push_back("the base stood still when it was recorded: its velocities are not sent");
  }
  if (recorded_.track->isLocalized() && !live.T_map_odom) {
    notes_.push_back("nobody localizes the robot now (tf's " + live_frames_.map + " -> " +
                     live_frames_.odometry +
                     "): the base is followed on its odometry alone, which drifts");
  }
  drive_ = std::move(drive);
}

void ReplayedBase::addTo(replay::PlayReport& report) const {
  std::vector<std::string> notes = notes_;
  if (!recorded_.why_open_loop.empty()) {
    if (recorded_.first_motion) {
      notes.push_back(
          "the base was driven in open loop, by its recorded velocities, and ended wherever they "
          "led: " +
          recorded_.why_open_loop);
    }
    report.base.emplace();
    report.base->topic = recorded_.played_topics;
    report.base->why_open_loop = recorded_.why_open_loop;
  } else if (recorded_.track) {
    notes.insert(notes.end(), recorded_.track->remarks.begin(), recorded_.track->remarks.end());
    const std::vector<std::string> slowed = slowedDrives();
    notes.insert(notes.end(), slowed.begin(), slowed.end());
  }
  if (report.base && report.base->driven) {
    tellObstacles(report.base->driven->obstacles, report.base->driven->frame,
                  plan_.behavior.begin, notes);
    tellLeftAside(*report.base->driven, notes);
  }
  report.notes.insert(report.notes.end(), notes.begin(), notes.end());
}

OpenLoopMonitor::OpenLoopMonitor(const replay::PlayPlan& plan, replay::MessageSink& sink,
                                 const replay::ObstacleOptions& options,
                                 std::function<replay::BaseInput()> look,
                                 std::function<void(const std::string&)> stop)
    : sink_(sink),
      obstacles_(options, "the base's frame"),
      look_(std::move(look)),
      stop_(std::move(stop)) {
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (topic.isPlayed() && isVelocity(topic.channel)) topics_.insert(topic.output.topic);
  }
}

bool OpenLoopMonitor::publish(const replay::Channel& channel, const replay::Bytes& bytes) {
  if (topics_.count(channel.topic) == 0 || replay::isZero(replay::velocityOf(bytes))) {
    return sink_.publish(channel, bytes);
  }
  const std::string why_not = whyNot(bytes);
  if (why_not.empty()) return sink_.publish(channel, bytes);
  stop_("the base, which cannot wait in open loop: " + why_not);
  return sink_.publish(channel, replay::velocityMessage(bytes, {}, rosStampNow()));
}

/// Returns why the base must not be told this velocity; empty if it may.
std::string OpenLoopMonitor::whyNot(const replay::Bytes& bytes) {
  const replay::Velocity velocity = replay::velocityOf(bytes);
  const replay::PlanarVelocity wanted{velocity[0], velocity[5], velocity[1]};
  const replay::ObstacleOptions& options = obstacles_.options();
  const double radius = options.footprint.radius();
  const double speed = replay::rimSpeed(wanted, radius);
  const double way = obstacles_.wayToStop(speed);
  const replay::BaseInput input = look_();
  const replay::PlanarPose T_odom_base =
      input.T_odom_base ? input.T_odom_base->pose : replay::PlanarPose();
  if (input.T_odom_base) obstacles_.move(input.T_odom_base->stamp, T_odom_base);
  obstacles_.hear(input.scan);
  const auto verdict = obstacles_.judge({input.now, T_odom_base, {}, input.now, 0},
                                        pathOf(wanted, radius, way));
  if (verdict.kind != replay::ObstacleStop::Verdict::Kind::Go) return verdict.reason;
  if (verdict.speed >= speed) return "";
  return verdict.is_unseen && verdict.speed == options.unseen_speed
             ? fmt::format("{:.2f} m/s where the scan does not look are too fast", speed)
             : fmt::format("something in its way is too near for {:.2f} m/s", speed);
}

}  // namespace afterglow::nodes
