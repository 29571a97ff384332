#include "nodes/player/replayed_base.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <utility>

#include "nodes/player/ros_clock.hpp"
#include "replay/motion/velocity.hpp"

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

}  // namespace

replay::TrackFrames liveFrames(const BaseOptions& options, const replay::PlayPlan& plan) {
  const auto& settings = plan.rewriting;
  const replay::TrackFrames& recorded = options.frames;
  return {settings.frame(recorded.map), settings.frame(recorded.odometry),
          settings.frame(recorded.base), options.tf_topic};
}

ReplayedBase::ReplayedBase(const replay::Store& store, const replay::PlayPlan& plan,
                           const BaseOptions& options, const replay::MotionLimits& limits)
    : store_(store),
      plan_(plan),
      options_(options),
      limits_(limits),
      live_frames_(liveFrames(options, plan)) {
  std::vector<std::string> played;
  for (const replay::PlannedTopic* topic : velocityTopics(plan)) {
    played.push_back(topic->channel.topic);
  }
  played_topics_ = fmt::format("{}", fmt::join(played, ", "));
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (!topic.is_for_start) continue;
    is_for_start_ = true;
    topic_ = &topic;
    sample_.resize(sizeof(replay::Velocity));
    return;
  }
  topic_ = chooseTopic();
  readVelocities();
  if (options.is_open_loop) {
    why_open_loop_ = "that was asked for";
  } else if (played.empty()) {
    why_not_ = "a drive that steers is led along no track";
  } else if (!first_motion_) {
    why_open_loop_ = "its recorded velocities are zeros";
  } else if (!topic_) {
    why_not_ = "velocities are played on " + played_topics_ +
               ", and it was not said which are the base's (--base-topic, ~base_topic)";
  } else if (options.has_recorded_time) {
    why_not_ = "the recording's time is played, which the robot's poses do not keep";
  } else {
    readTrack();
  }
}

const replay::PlannedTopic* ReplayedBase::chooseTopic() const {
  const std::vector<const replay::PlannedTopic*> all = velocityTopics(plan_);
  const bool is_said = !options_.topic.empty();
  if (!is_said && all.size() == 1) return all.front();
  const std::string& wanted = is_said ? options_.topic : options_.usual_topic;
  for (const replay::PlannedTopic* topic : all) {
    if (wanted == topic->channel.topic || wanted == topic->output.topic) return topic;
  }
  if (!is_said) return nullptr;
  throw std::runtime_error("no velocities are played on " + options_.topic +
                           ", the base's topic; there are " + played_topics_);
}

/// Reads the velocities of all played topics: until the base's topics are known, every one counts.
void ReplayedBase::readVelocities() {
  for (const replay::PlannedTopic* topic : velocityTopics(plan_)) {
    if (topic_ && topic != topic_) continue;
    const auto messages =
        store_.messages(plan_.behavior, {{topic->channel.topic}, plan_.begin, plan_.end});
    while (const auto message = messages->next()) {
      if (sample_.empty()) sample_ = message->bytes;
      if (replay::isZero(replay::velocityOf(message->bytes))) continue;
      if (!first_motion_) first_motion_ = message->received;
      first_motion_ = std::min(*first_motion_, message->received);
      last_motion_ = std::max(last_motion_.value_or(message->received), message->received);
    }
  }
  if (!topic_ || sample_.empty()) return;
  replay::Rewriter rewriter([] { return std::string(); }, plan_.rewriting);
  (void)rewriter.rewrite(topic_->channel, {}, sample_);
}

void ReplayedBase::readTrack() {
  track_ = readPoseTrack(store_, plan_.behavior, options_.frames, options_.noise, why_not_);
  if (track_) why_not_ = missingThen();
}

/// Returns what is missing of the poses of the part that is played.
std::string ReplayedBase::missingThen() const {
  if (!track_->isLocalized() && !options_.is_odometry_enough) {
    return "it was recorded without localization (" + options_.frames.map + " -> " +
           options_.frames.odometry + "); --odometry-only follows its odometry, from where it is";
  }
  return whyIncomplete(*track_, *first_motion_, *last_motion_);
}

std::string ReplayedBase::missingNow(const std::function<bool()>& is_stopped) {
  const bool is_localized = track_->isLocalized();
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

std::string ReplayedBase::cannotFollow(const std::string& why) const {
  return "the base cannot follow its recorded poses: " + why +
         "; --open-loop (~open_loop) sends its recorded velocities, wherever they lead";
}

std::string ReplayedBase::recordedRefusal() const {
  if (!why_open_loop_.empty()) return "";
  return why_not_.empty() ? whyTooSlow() : cannotFollow(why_not_);
}

std::string ReplayedBase::whyTooSlow() const {
  const std::vector<std::string> slowed =
      options_.keeps_rate ? slowedDrives() : std::vector<std::string>();
  return slowed.empty() ? "" : slowed.front() + "; without --keep-rate the rest waits for it";
}

std::string ReplayedBase::refusal(const std::function<bool()>& is_stopped) {
  poses_.emplace(live_frames_);
  if (is_for_start_ || !why_open_loop_.empty()) return "";
  if (const std::string why = recordedRefusal(); !why.empty()) return why;
  const std::string why = missingNow(is_stopped);
  return why.empty() || is_stopped() ? "" : cannotFollow(why);
}

replay::TrackerOptions ReplayedBase::trackerOptions() const {
  replay::TrackerOptions options;
  options.noise = options_.noise;
  if (limits_.linear) options.speed = std::min(options.speed, *limits_.linear);
  if (limits_.angular) options.turn_speed = std::min(options.turn_speed, *limits_.angular);
  const replay::DriveLimits shown = track_ ? shownBy(*track_) : options;
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
  if (!track_ || !why_not_.empty()) return {};
  std::vector<std::string> slowed;
  const replay::BaseDrive drive(topic_->channel.topic, sample_, *track_, plan_.begin, plan_.end,
                                trackerOptions(), {});
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
  if (!scan.topic.empty() || !first_motion_) return "";  // without the latter it only hears zeros
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
  if (!track_) return {};
  const replay::PoseError share = combined(share_then, share_now_), &one = track_->measured_error;
  return {2 * one.position * share.position, 2 * one.yaw * share.yaw};
}

std::string ReplayedBase::driveTo(const replay::PlanarPose& pose, GuardedSink& sink,
                                  const std::function<bool()>& is_stopped) {
  if (!topic_ || sample_.size() < sizeof(replay::Velocity)) return why_open_loop_;
  if (!scan_ && !options_.scan.is_waived) return "nothing sees what stands in its way (--scan)";
  const replay::PoseTrack goal({{stampNow(), pose}}, live_frames_.map, true);
  replay::TrackerOptions options = trackerOptions();
  options.lost_distance = kFarthestStart;
  options.approach = replay::approachOfStart();
  replay::BaseTracker tracker(goal, options);
  const auto send = [&](const replay::PlanarVelocity& velocity) {
    sink.publish(topic_->output, replay::velocityMessage(sample_, velocity, rosStampNow()));
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
  if (!track_) return;
  const replay::BaseInput live = poses_->wait(track_->isLocalized(), kPosesPatience, is_stopped);
  replay::TrackerOptions options = trackerOptions();
  options.with_localization = live.T_map_odom.has_value();
  auto drive = std::make_unique<replay::BaseDrive>(
      topic_->channel.topic, sample_, *track_, plan_.begin, plan_.end, options,
      // Not the player's time: poses are dated by stampNow().
      [this](replay::Stamp) { return look(); });
  if (!drive->hasDrives()) {
    notes_.push_back("the base stood still when it was recorded: its velocities are not sent");
  }
  if (track_->isLocalized() && !live.T_map_odom) {
    notes_.push_back("nobody localizes the robot now (tf's " + live_frames_.map + " -> " +
                     live_frames_.odometry +
                     "): the base is followed on its odometry alone, which drifts");
  }
  drive_ = std::move(drive);
}

void ReplayedBase::addTo(replay::PlayReport& report) const {
  std::vector<std::string> notes = notes_;
  if (!why_open_loop_.empty()) {
    if (first_motion_) {
      notes.push_back(
          "the base was driven in open loop, by its recorded velocities, and ended wherever they "
          "led: " +
          why_open_loop_);
    }
    report.base.emplace();
    report.base->topic = played_topics_;
    report.base->why_open_loop = why_open_loop_;
  } else if (track_) {
    notes.insert(notes.end(), track_->remarks.begin(), track_->remarks.end());
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

}  // namespace afterglow::nodes
