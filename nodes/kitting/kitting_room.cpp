#include "nodes/kitting/kitting_room.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/fetch/robot_model.hpp"
#include "nodes/kitting/kitting_messages.hpp"
#include "render/scene/tessellate.hpp"

namespace afterglow::nodes {
namespace {

using visualization_msgs::Marker;

constexpr float kGhostAlpha = 0.25f;
/// The least length of a ghost's part that is shown, of its longest: more is a tangle of lines.
constexpr float kGhostPart = 0.39f;
constexpr double kHalfView = 0.1;  // m around a thing's origin that its camera image shows
constexpr std::size_t kBeams = 662;
constexpr double kFirstAngle = -1.92, kAngleStep = 0.0058, kRange = 25;  // rad, rad, m
constexpr double kLaserHeight = 0.2878;                                  // m

Marker markerOf(const render::Drawable& part) {
  Marker marker;
  marker.type = Marker::CUBE;
  if (const auto* cylinder = std::get_if<render::Cylinder>(&part.shape)) {
    marker.type = Marker::CYLINDER;
    setLook(marker, cylinder->size.cast<double>(), part.color);
  } else {
    setLook(marker, std::get<render::Cube>(part.shape).size.cast<double>(), part.color);
  }
  return marker;
}

float extentOf(const render::Drawable& part) {
  const auto* cylinder = std::get_if<render::Cylinder>(&part.shape);
  return (cylinder ? cylinder->size : std::get<render::Cube>(part.shape).size).maxCoeff();
}

/// Returns true if a ghost of the thing shows this part.
bool isTelling(const render::Drawable& part, const Thing& thing) {
  const auto is_shorter = [](const auto& a, const auto& b) { return extentOf(a) < extentOf(b); };
  const auto longest = std::max_element(thing.parts.begin(), thing.parts.end(), is_shorter);
  return extentOf(part) >= kGhostPart * extentOf(*longest);
}

// Moeller and Trumbore: distance in units of `direction`; empty if the ray misses.
std::optional<double> hit(const std::array<Eigen::Vector3d, 3>& t, const Eigen::Vector3d& origin,
                          const Eigen::Vector3d& direction) {
  const Eigen::Vector3d edge1 = t[1] - t[0], edge2 = t[2] - t[0];
  const Eigen::Vector3d p = direction.cross(edge2);
  const double determinant = edge1.dot(p);
  if (std::abs(determinant) < 1e-14) return std::nullopt;
  const Eigen::Vector3d s = origin - t[0];
  const double u = s.dot(p) / determinant;
  if (u < 0 || u > 1) return std::nullopt;
  const Eigen::Vector3d q = s.cross(edge1);
  const double v = direction.dot(q) / determinant;
  if (v < 0 || u + v > 1) return std::nullopt;
  const double distance = edge2.dot(q) / determinant;
  if (distance <= 0) return std::nullopt;
  return distance;
}

/// Of the laser's frame.
Eigen::Vector3d beam(std::size_t index) {
  const double angle = kFirstAngle + static_cast<double>(index) * kAngleStep;
  return {std::cos(angle), std::sin(angle), 0};
}

}  // namespace

std::vector<Thing> loadThings(const std::string& path) {
  const RobotModel room = RobotModel::fromFile(path);
  std::vector<Thing> things;
  for (const Joint& joint : room.joints()) {
    Thing thing;
    thing.name = joint.child;
    thing.is_furniture = joint.parent == room.rootLink();
    thing.is_low = joint.parent == "obstacles";
    thing.T_map_thing = room.linkPose(joint.child, {});
    thing.parts = room.drawables({{joint.child, Eigen::Isometry3d::Identity()}});
    if (!thing.parts.empty()) things.push_back(std::move(thing));
  }
  return things;
}

KittingRoom::KittingRoom(std::vector<Thing> things) : things_(std::move(things)) {
  std::set<std::string> names;
  for (const Thing& thing : things_) {
    if (!names.insert(thing.name).second) {
      throw std::invalid_argument("two things in the room are called '" + thing.name + "'");
    }
    surfaces_.push_back(trianglesOf(thing));
  }
}

std::vector<KittingRoom::Triangle> KittingRoom::trianglesOf(const Thing& thing) {
  std::vector<Triangle> triangles;
  render::Tessellation made;
  for (render::Drawable part : thing.parts) {
    part.pose = Rigid<World, World>(thing.T_map_thing * part.pose.matrix());
    render::tessellate(part, {}, made);
    const auto& p = made.mesh.points;
    for (const auto& t : made.mesh.triangles) triangles.push_back({p[t[0]], p[t[1]], p[t[2]]});
  }
  return triangles;
}

std::size_t KittingRoom::indexOf(const std::string& name) const {
  const auto found = std::find_if(things_.begin(), things_.end(),
                                  [&](const Thing& thing) { return thing.name == name; });
  if (found == things_.end()) throw std::invalid_argument("there is no '" + name + "' in the room");
  return static_cast<std::size_t>(found - things_.begin());
}

const Thing& KittingRoom::thing(const std::string& name) const { return things_[indexOf(name)]; }

void KittingRoom::carry(const std::string& name, const std::string& link,
                        const Eigen::Isometry3d& T_link_thing) {
  Thing& thing = things_[indexOf(name)];
  thing.carrier = link;
  thing.T_carrier_thing = T_link_thing;
}

void KittingRoom::putDown(const std::string& name, const Eigen::Isometry3d& T_map_thing) {
  Thing& thing = things_[indexOf(name)];
  thing.carrier.clear();
  thing.T_map_thing = T_map_thing;
  surfaces_[indexOf(name)] = trianglesOf(thing);
}

void KittingRoom::removeObjects() {
  for (Thing& thing : things_) thing.is_gone = !thing.is_furniture;
}

visualization_msgs::MarkerArray KittingRoom::markers() const {
  visualization_msgs::MarkerArray array = noMarkers();
  for (const Thing& thing : things_) {
    const bool is_carried = !thing.carrier.empty();
    for (std::size_t i = 0; i < thing.parts.size(); ++i) {
      if (thing.is_gone && !isTelling(thing.parts[i], thing)) continue;
      Marker marker = markerOf(thing.parts[i]);
      marker.header.frame_id = is_carried ? thing.carrier : "map";
      marker.ns = thing.name;
      marker.id = static_cast<int>(i);
      marker.pose = toPoseMessage((is_carried ? thing.T_carrier_thing : thing.T_map_thing) *
                                  thing.parts[i].pose.matrix());
      marker.frame_locked = true;  // what is carried moves with the gripper
      if (thing.is_gone) marker.color.a = kGhostAlpha;
      array.markers.push_back(marker);
    }
  }
  return array;
}

geometry_msgs::PoseArray KittingRoom::obstacles() const {
  geometry_msgs::PoseArray array;
  array.header.frame_id = "map";
  for (const Thing& thing : things_) {
    if (thing.is_gone) continue;
    for (const render::Drawable& part : thing.parts) {
      const visualization_msgs::Marker marker = markerOf(part);
      const Eigen::Isometry3d T_map_part(thing.T_map_thing * part.pose.matrix());
      const Eigen::Vector3d middle = T_map_part.translation();
      if (std::abs(middle.z() - kLaserHeight) > marker.scale.z / 2) continue;
      array.poses.emplace_back();
      array.poses.back().position = toPointMessage(
          {middle.x(), middle.y(), (marker.scale.x + marker.scale.y) / 4});
      array.poses.back().orientation.w = 1;
    }
  }
  return array;
}

std::vector<geometry_msgs::TransformStamped> KittingRoom::surfaces() const {
  std::vector<geometry_msgs::TransformStamped> frames;
  for (const Thing& thing : things_) {
    if (!thing.is_furniture) continue;
    frames.emplace_back();
    frames.back().header.stamp = ros::Time::now();
    frames.back().header.frame_id = "map";
    frames.back().child_frame_id = thing.name;
    frames.back().transform = toTransform(thing.T_map_thing);
  }
  return frames;
}

std::optional<KittingRoom::Hit> KittingRoom::castRay(const Eigen::Vector3d& p_origin,
                                                     const Eigen::Vector3d& direction,
                                                     bool only_low) const {
  std::optional<Hit> nearest;
  for (std::size_t i = 0; i < things_.size(); ++i) {
    if (things_[i].is_gone || (only_low && !things_[i].is_low)) continue;
    for (const Triangle& triangle : surfaces_[i]) {
      const std::optional<double> distance = hit(triangle, p_origin, direction);
      if (distance && (!nearest || *distance < nearest->distance)) nearest = Hit{*distance, i};
    }
  }
  return nearest;
}

std::vector<Eigen::Vector3d> KittingRoom::visiblePoints(const std::string& name,
                                                        const Eigen::Vector3d& p_eye,
                                                        double spacing) const {
  const std::size_t wanted = indexOf(name);
  const Eigen::Vector3d ahead = things_[wanted].T_map_thing.translation() - p_eye;
  const Eigen::Vector3d right = ahead.cross(Eigen::Vector3d::UnitZ()).normalized();
  const Eigen::Vector3d up = right.cross(ahead).normalized();
  std::vector<Eigen::Vector3d> visible;
  for (double u = -kHalfView; u <= kHalfView; u += spacing) {
    for (double v = -kHalfView; v <= kHalfView; v += spacing) {
      const Eigen::Vector3d direction = (ahead + u * right + v * up).normalized();
      const std::optional<Hit> first = castRay(p_eye, direction, false);
      if (first && first->thing == wanted) visible.push_back(p_eye + first->distance * direction);
    }
  }
  return visible;
}

sensor_msgs::LaserScan KittingRoom::scan(const Eigen::Isometry3d& T_map_laser) const {
  sensor_msgs::LaserScan scan = noScan();
  for (std::size_t i = 0; i < kBeams; ++i) {
    const auto first = castRay(T_map_laser.translation(), T_map_laser.linear() * beam(i), true);
    const bool is_seen = first && first->distance <= kRange;
    scan.ranges.push_back(is_seen ? static_cast<float>(first->distance)
                                  : std::numeric_limits<float>::infinity());
  }
  return scan;
}

sensor_msgs::LaserScan noScan() {
  sensor_msgs::LaserScan scan;
  scan.header.frame_id = "laser_link";
  scan.header.stamp = ros::Time::now();
  scan.angle_min = static_cast<float>(kFirstAngle);
  scan.angle_increment = static_cast<float>(kAngleStep);
  scan.angle_max = static_cast<float>(kFirstAngle + static_cast<double>(kBeams - 1) * kAngleStep);
  scan.range_min = 0.05f;
  scan.range_max = static_cast<float>(kRange);
  return scan;
}

std::vector<Eigen::Vector3d> scanPoints(const sensor_msgs::LaserScan& scan,
                                        const Eigen::Isometry3d& T_map_laser) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    if (std::isfinite(scan.ranges[i])) points.push_back(T_map_laser * (scan.ranges[i] * beam(i)));
  }
  return points;
}

}  // namespace afterglow::nodes
