#include "nodes/kitting/kitting_world.hpp"

#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

namespace afterglow::nodes {
namespace {

constexpr int kCylinderSides = 24;
constexpr double kTouching = 1e-4;  // a point seen this close to the nearest hit is that hit

std::vector<Eigen::Vector2d> outlineOf(const Part& part) {
  const Eigen::Vector2d half = part.size.head<2>() / 2;
  if (part.shape == Part::Shape::Prism) return part.outline;
  if (part.shape == Part::Shape::Box) {
    return {{-half.x(), -half.y()}, {half.x(), -half.y()}, half, {-half.x(), half.y()}};
  }
  std::vector<Eigen::Vector2d> circle;
  for (int i = 0; i < kCylinderSides; ++i) {
    const double angle = 2 * M_PI * i / kCylinderSides;
    circle.emplace_back(half.x() * std::cos(angle), half.y() * std::sin(angle));
  }
  return circle;
}

std::vector<Triangle> trianglesInMap(const Thing& thing) {
  std::vector<Triangle> result;
  for (const Part& part : thing.parts) {
    const Eigen::Isometry3d T_map_part = thing.T_map_thing * part.T_thing_part;
    for (const Triangle& t : partTriangles(part)) {
      result.push_back({T_map_part * t[0], T_map_part * t[1], T_map_part * t[2]});
    }
  }
  return result;
}

Eigen::Vector3d normalOf(const Triangle& t) { return (t[1] - t[0]).cross(t[2] - t[0]); }

// Moeller and Trumbore: distance in units of `direction`; empty if the ray misses.
std::optional<double> hit(const Triangle& t, const Eigen::Vector3d& origin,
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

// A regular grid in the triangle's plane, anchored to the world so that neighbors share it.
std::vector<Eigen::Vector3d> samples(const Triangle& t, double spacing) {
  const Eigen::Vector3d normal = normalOf(t).normalized();
  const Eigen::Vector3d reference =
      std::abs(normal.z()) > 0.5 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d a = (reference - normal * reference.dot(normal)).normalized();
  const Eigen::Vector3d b = normal.cross(a);
  double low_a = INFINITY, high_a = -INFINITY, low_b = INFINITY, high_b = -INFINITY;
  for (const Eigen::Vector3d& corner : t) {
    low_a = std::min(low_a, corner.dot(a)), high_a = std::max(high_a, corner.dot(a));
    low_b = std::min(low_b, corner.dot(b)), high_b = std::max(high_b, corner.dot(b));
  }
  std::vector<Eigen::Vector3d> points;
  const double height = t[0].dot(normal);
  for (double i = std::ceil(low_a / spacing) * spacing; i <= high_a; i += spacing) {
    for (double j = std::ceil(low_b / spacing) * spacing; j <= high_b; j += spacing) {
      const Eigen::Vector3d point = a * i + b * j + normal * height;
      if (hit(t, point + normal, -normal)) points.push_back(point);
    }
  }
  return points;
}

}  // namespace

std::vector<Triangle> partTriangles(const Part& part) {
  const std::vector<Eigen::Vector2d> outline = outlineOf(part);
  const double top = part.size.z() / 2;
  const auto at = [&](std::size_t i, double z) {
    const Eigen::Vector2d& p = outline[i % outline.size()];
    return Eigen::Vector3d(p.x(), p.y(), z);
  };
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    triangles.push_back({at(i, -top), at(i + 1, -top), at(i + 1, top)});
    triangles.push_back({at(i, -top), at(i + 1, top), at(i, top)});
    if (i == 0 || i + 1 == outline.size()) continue;
    triangles.push_back({at(0, top), at(i, top), at(i + 1, top)});
    triangles.push_back({at(0, -top), at(i + 1, -top), at(i, -top)});
  }
  return triangles;
}

World::World(std::vector<Thing> things) : things_(std::move(things)) {
  std::set<std::string> names;
  for (const Thing& thing : things_) {
    if (!names.insert(thing.name).second) {
      throw std::invalid_argument("two things in the room are called '" + thing.name + "'");
    }
    surfaces_.push_back(trianglesInMap(thing));
  }
}

std::size_t World::indexOf(const std::string& name) const {
  for (std::size_t i = 0; i < things_.size(); ++i) {
    if (things_[i].name == name) return i;
  }
  throw std::invalid_argument("there is no '" + name + "' in the room");
}

const Thing& World::thing(const std::string& name) const { return things_[indexOf(name)]; }

void World::place(const std::string& name, const Eigen::Isometry3d& T_map_thing) {
  const std::size_t index = indexOf(name);
  things_[index].T_map_thing = T_map_thing;
  surfaces_[index] = trianglesInMap(things_[index]);
}

void World::removeObjects() {
  for (std::size_t i = things_.size(); i-- > 0;) {
    if (things_[i].furniture) continue;
    things_.erase(things_.begin() + static_cast<std::ptrdiff_t>(i));
    surfaces_.erase(surfaces_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

std::vector<Eigen::Vector3d> World::visiblePoints(const std::string& name,
                                                  const Eigen::Vector3d& p_eye,
                                                  double spacing) const {
  std::vector<Eigen::Vector3d> visible;
  for (const Triangle& triangle : surfaces_[indexOf(name)]) {
    if (normalOf(triangle).dot(p_eye - triangle[0]) <= 0) continue;
    for (const Eigen::Vector3d& point : samples(triangle, spacing)) {
      const double distance = (point - p_eye).norm();
      const std::optional<double> first = castRay(p_eye, (point - p_eye) / distance);
      if (first && *first > distance - kTouching) visible.push_back(point);
    }
  }
  return visible;
}

std::optional<double> World::castRay(const Eigen::Vector3d& p_origin,
                                     const Eigen::Vector3d& direction, bool only_low) const {
  std::optional<double> nearest;
  for (std::size_t i = 0; i < things_.size(); ++i) {
    if (only_low && !things_[i].low) continue;
    for (const Triangle& triangle : surfaces_[i]) {
      const std::optional<double> distance = hit(triangle, p_origin, direction);
      if (distance && (!nearest || *distance < *nearest)) nearest = distance;
    }
  }
  return nearest;
}

std::vector<float> scanObstacles(const World& world, const Eigen::Isometry3d& T_map_laser,
                                 const ScanGeometry& geometry) {
  std::vector<float> ranges(geometry.beams, std::numeric_limits<float>::infinity());
  for (int i = 0; i < geometry.beams; ++i) {
    const double angle = geometry.angle_min + i * geometry.angle_increment;
    const Eigen::Vector3d beam(std::cos(angle), std::sin(angle), 0);
    const std::optional<double> distance =
        world.castRay(T_map_laser.translation(), T_map_laser.linear() * beam, true);
    if (distance && *distance <= geometry.range_max) ranges[i] = static_cast<float>(*distance);
  }
  return ranges;
}

std::vector<Eigen::Vector3d> scanPoints(const std::vector<float>& ranges,
                                        const Eigen::Isometry3d& T_map_laser,
                                        const ScanGeometry& geometry) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    if (!std::isfinite(ranges[i])) continue;
    const double angle = geometry.angle_min + static_cast<double>(i) * geometry.angle_increment;
    points.push_back(T_map_laser *
                     Eigen::Vector3d(ranges[i] * std::cos(angle), ranges[i] * std::sin(angle), 0));
  }
  return points;
}

}  // namespace afterglow::nodes
