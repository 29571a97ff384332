#include "nodes/kitting/kitting_drive.hpp"

#include <geometry_msgs/Twist.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/kitting/kitting_messages.hpp"
#include "nodes/player/base_sensors.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kStep = 0.05;      // m between path points
constexpr double kGrow = 0.02;      // m by which a detour is widened until it is clear
constexpr double kWidest = 3.0;     // m; a detour wider than this is none
constexpr double kTurnStep = 0.05;  // rad between the poses of a turn
constexpr double kSpeed = 0.6, kAcceleration = 0.5;          // m/s, m/s^2
constexpr double kTurnSpeed = 1.3, kTurnAcceleration = 2.0;  // rad/s, rad/s^2

// sin^2 leaves and reaches the straight line without a corner.
FloorPath bent(const Eigen::Vector2d& start, const Eigen::Vector2d& goal, double offset) {
  const Eigen::Vector2d along = goal - start;
  const Eigen::Vector2d left = Eigen::Vector2d(-along.y(), along.x()).normalized();
  const int count = std::max(2, static_cast<int>(std::ceil(along.norm() / kStep)));
  FloorPath path;
  for (int i = 0; i <= count; ++i) {
    const double s = static_cast<double>(i) / count;
    const double bend = std::sin(M_PI * s);
    path.push_back(start + along * s + left * offset * bend * bend);
  }
  return path;
}

bool isClear(const FloorPath& path, const std::vector<Eigen::Vector2d>& obstacle,
             double clearance) {
  for (const Eigen::Vector2d& p : path) {
    for (const Eigen::Vector2d& o : obstacle) {
      if ((p - o).norm() < clearance) return false;
    }
  }
  return true;
}

using Samples = std::vector<replay::PoseTrack::Sample>;

/// Goes on through these poses, one every `step` (m or rad), as fast as a motion from rest to rest
/// with these limits is there.
void append(Samples& samples, const std::vector<PlanarPose>& poses, double step, double speed,
            double acceleration) {
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto from_rest = static_cast<double>(std::min(i, poses.size() - 1 - i)) + 0.5;
    const double now = std::min(speed, std::sqrt(2 * acceleration * step * from_rest));
    const auto passed_ns = static_cast<std::int64_t>(step / now * 1e9);
    samples.push_back({{samples.back().stamp.ns + passed_ns}, poses[i]});
  }
}

void appendTurn(Samples& samples, double yaw) {
  const PlanarPose from = samples.back().pose;
  const double way = replay::wrapAngle(yaw - from.yaw);
  const int count = static_cast<int>(std::ceil(std::abs(way) / kTurnStep));
  std::vector<PlanarPose> poses;
  for (int i = 1; i <= count; ++i) poses.push_back({from.x, from.y, from.yaw + way * i / count});
  append(samples, poses, count > 0 ? std::abs(way) / count : 0, kTurnSpeed, kTurnAcceleration);
}

}  // namespace

double lengthOf(const FloorPath& path) {
  double length = 0;
  for (std::size_t i = 1; i < path.size(); ++i) length += (path[i] - path[i - 1]).norm();
  return length;
}

FloorPath planDetour(const Eigen::Vector2d& start, const Eigen::Vector2d& goal,
                     const std::vector<Eigen::Vector2d>& obstacle, double clearance) {
  if (!isClear({start, goal}, obstacle, clearance)) {
    throw std::invalid_argument("an obstacle stands where the robot is or wants to go");
  }
  for (double offset = 0; offset < kWidest; offset += kGrow) {
    for (const double side : {offset, -offset}) {
      FloorPath path = bent(start, goal, side);
      if (isClear(path, obstacle, clearance)) return path;
    }
  }
  throw std::invalid_argument("there is no way round the obstacle");
}

Eigen::Vector2d pointAlong(const FloorPath& path, double distance) {
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Eigen::Vector2d step = path[i] - path[i - 1];
    const double length = step.norm();
    if (distance <= length && length > 0) return path[i - 1] + step * (distance / length);
    distance -= length;
  }
  return path.back();
}

double nearestAlong(const FloorPath& path, const Eigen::Vector2d& position) {
  double best = INFINITY, best_along = 0, along = 0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Eigen::Vector2d step = path[i] - path[i - 1];
    const double length = step.norm();
    const double on =
        length > 0 ? std::clamp((position - path[i - 1]).dot(step) / length, 0., length) : 0;
    const double distance = (path[i - 1] + step * (length > 0 ? on / length : 0) - position).norm();
    if (distance < best) best = distance, best_along = along + on;
    along += length;
  }
  return best_along;
}

TimedDrive timedDrive(const FloorPath& path, const PlanarPose& start, double final_yaw,
                      replay::Stamp begin) {
  Samples samples = {{begin, start}};
  appendTurn(samples, headingOf(path[1] - path[0]));
  const replay::Stamp turned = samples.back().stamp;
  std::vector<PlanarPose> poses;
  for (std::size_t i = 1; i < path.size(); ++i) {
    poses.push_back({path[i].x(), path[i].y(), headingOf(path[i] - path[i - 1])});
  }
  append(samples, poses, lengthOf(path) / static_cast<double>(poses.size()), kSpeed, kAcceleration);
  appendTurn(samples, final_yaw);
  return {replay::PoseTrack(std::move(samples), "map", true), turned};
}

namespace {

const Eigen::Vector2d kGoal(0.0, 2.8);  // of base_link; it faces along x there
constexpr double kClearance = 0.52;     // m from the robot's center to every obstacle point
constexpr double kPerceive = 1.4;       // s that it looks at obstacle and path before it drives
constexpr double kSaysAfter = 2.6;      // s into the behavior
constexpr double kHeadTilt = 0.7, kHeadSeconds = 1.0;                          // rad, s
constexpr double kCommandPeriod = 0.04, kScanPeriod = 0.1, kPathPeriod = 2.0;  // s
constexpr double kAimPeriod = 0.5;     // s between two aimings of the turret
constexpr double kAimAhead = 1.15;     // m along the path
constexpr double kAimWidest = 0.61;    // rad: the light points no further to the side than this
constexpr double kNearestLight = 0.9;  // m ahead: the turret does not point at the robot's own feet

/// Returns the options of a robot that knows where it is: it stands at the end without looking
/// again.
replay::TrackerOptions trackerOptions() {
  replay::TrackerOptions options;
  options.noise.position = options.noise.yaw = 0.005;
  options.approach.most_attempts = 0;
  options.approach.longest_stand = options.approach.shortest_stand;
  return options;
}

bool isDriving(const replay::BaseTracker& tracker) {
  return tracker.state() == replay::BaseState::Following ||
         tracker.state() == replay::BaseState::Approaching;
}

/// Returns true if it is time; the next time is a period later.
bool isDue(ros::Time& next, double period) {
  if (ros::Time::now() < next) return false;
  next = ros::Time::now() + ros::Duration(period);
  return true;
}

geometry_msgs::Twist twist(const PlanarVelocity& velocity) {
  geometry_msgs::Twist message;
  message.linear.x = velocity.forward;
  message.angular.z = velocity.turn;
  return message;
}

}  // namespace

KittingDrive::KittingDrive(KittingRobot& robot, const KittingRoom& room, Callbacks callbacks)
    : robot_(robot), room_(room), callbacks_(std::move(callbacks)) {}

void KittingDrive::run() {
  robot_.startHead(0, kHeadTilt, kHeadSeconds);
  perceiveAndPlan();
  begin_ = ros::Time::now();
  BasePoses poses{replay::TrackFrames{}};
  replay::BaseTracker tracker(drive_->track, trackerOptions());
  for (ros::Time tick = begin_; isDriving(tracker);) {
    const replay::BaseInput input = poses.look(stampNow());
    const bool drives = (ros::Time::now() - begin_).toSec() >= kPerceive;
    robot_.out().wheels.publish(twist(drives ? tracker.update(input) : PlanarVelocity()));
    tellWhatIsDue(tracker);
    showWhatIsDue();
    aimAhead(tracker);
    tick += ros::Duration(kCommandPeriod);
    sleepFor((tick - ros::Time::now()).toSec());
  }
  robot_.out().wheels.publish(geometry_msgs::Twist());
  if (tracker.state() == replay::BaseState::Lost) throw TaskError(tracker.reason());
  callbacks_.on_moment("reach orientation");
}

void KittingDrive::perceiveAndPlan() {
  const Eigen::Isometry3d T_map_laser = robot_.T_map_link("laser_link");
  std::vector<Eigen::Vector2d> obstacle;
  for (const Eigen::Vector3d& p : scanPoints(room_.scan(T_map_laser), T_map_laser)) {
    obstacle.push_back(p.head<2>());
    p_obstacle_ += p.head<2>();
  }
  if (obstacle.empty()) throw TaskError("the laser sees nothing to drive round");
  p_obstacle_ /= static_cast<double>(obstacle.size());
  const PlanarPose start = toPlanarPose(robot_.T_map_base());
  try {
    path_ = planDetour(positionOf(start), kGoal, obstacle, kClearance);
  } catch (const std::invalid_argument& error) {
    throw TaskError(error.what());
  }
  drive_ = timedDrive(path_, start, 0, stampNow());
}

void KittingDrive::tellWhatIsDue(const replay::BaseTracker& tracker) {
  if (!has_spoken_ && (ros::Time::now() - begin_).toSec() >= kSaysAfter) {
    has_spoken_ = true;
    callbacks_.say();
  }
  if (!has_turned_ && tracker.progress() >= drive_->turned) {
    has_turned_ = true;
    callbacks_.on_moment("rotate");
  }
  const double along = nearestAlong(path_, positionOf(drive_->track.at(tracker.progress())));
  if (!has_passed_ && along > lengthOf(path_) / 2) {
    has_passed_ = true;
    callbacks_.on_moment("detour");
  }
}

void KittingDrive::showWhatIsDue() {
  if (isDue(next_scan_, kScanPeriod)) {
    robot_.out().scan.publish(room_.scan(robot_.T_map_link("laser_link")));
  }
  if (isDue(next_path_, kPathPeriod)) robot_.out().path.publish(pathMarkers(path_));
}

// Points where the robot will want to light when the turret gets there.
void KittingDrive::aimAhead(const replay::BaseTracker& tracker) {
  if (!isDue(next_aim_, kAimPeriod)) return;
  const replay::Stamp now = tracker.progress();
  const bool drives = now > drive_->track.begin();
  const auto ahead_ns = static_cast<std::int64_t>(drives ? kAimPeriod * 1e9 : 0);
  const PlanarPose pose = drive_->track.at({now.ns + ahead_ns});
  const Eigen::Vector2d way = pointToLight(positionOf(pose)) - positionOf(pose);
  const double distance = std::max(kNearestLight, way.norm());
  const double bearing = way.norm() < 0.1 ? 0 : replay::wrapAngle(headingOf(way) - pose.yaw);
  robot_.aimProjector({distance * std::cos(bearing), distance * std::sin(bearing), 0}, kAimPeriod,
                      kAimWidest);
}

// The path ahead and, until it is passed, the obstacle beside it.
Eigen::Vector2d KittingDrive::pointToLight(const Eigen::Vector2d& position) const {
  const double along = nearestAlong(path_, position);
  const Eigen::Vector2d ahead = pointAlong(path_, along + kAimAhead);
  const bool is_passed = nearestAlong(path_, p_obstacle_) < along + kNearestLight / 2;
  return is_passed ? ahead : Eigen::Vector2d((2 * ahead + p_obstacle_) / 3);
}

void KittingDrive::clearLight() {
  robot_.out().path.publish(noMarkers());
  robot_.out().scan.publish(noScan());
  robot_.startHead(0, 0, kHeadSeconds);
}

}  // namespace afterglow::nodes
