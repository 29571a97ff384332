#include "nodes/conversion/path_glyphs.hpp"

#include "render/scene/solids.hpp"

namespace afterglow::nodes {
namespace {

void addSolid(const render::Solid& solid, const Eigen::Affine3d& placed, render::Body& body) {
  const auto first = static_cast<std::uint32_t>(body.points.size());
  for (const Eigen::Vector3d& p : solid.points) body.points.push_back((placed * p).cast<float>());
  for (const auto& t : solid.triangles) {
    body.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
}

/// A unit cylinder laid along axis 0, 1 or 2, from `begin` on.
Eigen::Affine3d rod(int axis, double begin, double length, double diameter) {
  Eigen::Matrix3d R;  // the cylinder's z becomes the axis
  R.col(2) = Eigen::Vector3d::Unit(axis);
  R.col(0) = Eigen::Vector3d::Unit((axis + 1) % 3);
  R.col(1) = Eigen::Vector3d::Unit((axis + 2) % 3);
  Eigen::Affine3d placed = Eigen::Affine3d::Identity();
  placed.linear() = R * Eigen::Vector3d(diameter, diameter, length).asDiagonal();
  placed.translation() = (begin + length / 2) * Eigen::Vector3d::Unit(axis);
  return placed;
}

}  // namespace

void addAxes(const Eigen::Isometry3d& pose, float length, float diameter, render::Body& body) {
  for (int axis = 0; axis < 3; ++axis) {
    addSolid(render::unitCylinder(24), pose * rod(axis, 0, length, diameter), body);
    body.colors.resize(body.points.size(),
                       {axis == 0 ? 1.f : 0.f, axis == 1 ? 1.f : 0.f, axis == 2 ? 1.f : 0.f, 1});
  }
}

void addArrow(const Eigen::Isometry3d& pose, const render::Arrow& arrow, render::Body& body) {
  const double shaft = arrow.length - arrow.head_length, D = arrow.head_diameter;
  addSolid(render::unitCylinder(24), pose * rod(0, 0, shaft, arrow.shaft_diameter), body);
  Eigen::Affine3d head = Eigen::Affine3d::Identity();
  head.linear() = Eigen::Vector3d(arrow.head_length, D, D).asDiagonal();
  head.translation().x() = shaft;
  addSolid(render::unitCone(24), pose * head, body);
}

}  // namespace afterglow::nodes
