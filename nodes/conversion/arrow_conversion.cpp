#include "nodes/conversion/arrow_conversion.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace afterglow::nodes {
namespace {

constexpr float kHeadShare = 0.23f;   // of the length
constexpr float kHeadToShaft = 2.0f;  // diameters
constexpr int kSegments = 24;         // of an elliptic cross-section

/// A frustum about +x between two cross-sections, and the disc that closes it behind.
void addFrustum(render::PointList& triangles, float x0, const Eigen::Vector2f& radii0, float x1,
                const Eigen::Vector2f& radii1) {
  const auto at = [](float x, const Eigen::Vector2f& radii, int i) {
    const float angle = 2 * static_cast<float>(M_PI) * static_cast<float>(i) / kSegments;
    return Eigen::Vector3f(x, radii.x() * std::cos(angle), radii.y() * std::sin(angle));
  };
  for (int i = 0; i < kSegments; ++i) {
    const Eigen::Vector3f a = at(x0, radii0, i), b = at(x0, radii0, i + 1);
    const Eigen::Vector3f c = at(x1, radii1, i), d = at(x1, radii1, i + 1);
    for (const Eigen::Vector3f& corner : {a, c, b}) triangles.push_back(corner);
    if (!radii1.isZero()) {
      for (const Eigen::Vector3f& corner : {b, c, d}) triangles.push_back(corner);
    }
    for (const Eigen::Vector3f& corner : {a, b, Eigen::Vector3f(x0, 0, 0)}) {
      triangles.push_back(corner);
    }
  }
}

render::Triangles ellipticArrow(float length, float width, float height) {
  const Eigen::Vector2f shaft(width / 2, height / 2);
  const float neck = length * (1 - kHeadShare);
  render::Triangles arrow;
  addFrustum(arrow.points, 0, shaft, neck, shaft);
  addFrustum(arrow.points, neck, kHeadToShaft * shaft, length, Eigen::Vector2f::Zero());
  return arrow;
}

Converted<PlacedArrow> arrowAlongX(const Eigen::Vector3f& scale) {
  const float height = scale.z() == 0 ? scale.y() : scale.z();
  if (scale.x() <= 0 || scale.y() <= 0 || height <= 0) {
    return refused<PlacedArrow>("arrow's length or width is not positive");
  }
  PlacedArrow placed;
  if (height != scale.y()) {
    placed.shape = ellipticArrow(scale.x(), scale.y(), height);
  } else {
    placed.shape =
        render::Arrow{scale.x(), scale.y(), kHeadToShaft * scale.y(), kHeadShare * scale.x()};
  }
  return {std::move(placed), {}};
}

Converted<PlacedArrow> arrowBetween(const Eigen::Vector3d& start, const Eigen::Vector3d& end,
                                    const Eigen::Vector3f& scale) {
  const Eigen::Vector3d along = end - start;
  const auto length = static_cast<float>(along.norm());
  if (length <= 0) return refused<PlacedArrow>("arrow's start and end coincide");
  if (scale.minCoeff() < 0 || scale.head<2>().maxCoeff() == 0) {
    return refused<PlacedArrow>("arrow's length or width is not positive");
  }
  PlacedArrow placed;
  placed.T_marker_arrow.translation() = start;
  placed.T_marker_arrow.linear() =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), along).toRotationMatrix();
  const float head = scale.z() == 0 ? kHeadShare * length : std::min(scale.z(), length);
  placed.shape = render::Arrow{length, scale.x(), scale.y(), head};
  return {std::move(placed), {}};
}

}  // namespace

Converted<PlacedArrow> toArrow(const render::PointList& points, const Eigen::Vector3f& scale) {
  if (points.empty()) return arrowAlongX(scale);
  if (points.size() != 2) return refused<PlacedArrow>("ARROW of neither 0 nor 2 points");
  return arrowBetween(points[0].cast<double>(), points[1].cast<double>(), scale);
}

}  // namespace afterglow::nodes
