#include "nodes/conversion/beam_markers.hpp"

#include <visualization_msgs/Marker.h>

#include <optional>

namespace afterglow::nodes {
namespace {

using visualization_msgs::Marker;

constexpr int kPiecesPerSide = 16;  // a bent border follows the lens
constexpr float kSides = 0.12f, kEdges = 0.8f;  // alpha

geometry_msgs::Point toPoint(const Eigen::Vector3d& p) {
  geometry_msgs::Point point;
  point.x = p.x();
  point.y = p.y();
  point.z = p.z();
  return point;
}

/// Around the image, along the borders of its outermost pixels, at a distance; absent: no ray
/// reaches that place.
std::vector<std::optional<Eigen::Vector3d>> border(const calib::Lens& lens, double distance) {
  const Eigen::Vector2d corners[] = {{-0.5, -0.5},
                                     {lens.width - 0.5, -0.5},
                                     {lens.width - 0.5, lens.height - 0.5},
                                     {-0.5, lens.height - 0.5}};
  std::vector<std::optional<Eigen::Vector3d>> points;
  for (int side = 0; side < 4; ++side) {
    const Eigen::Vector2d &from = corners[side], &to = corners[(side + 1) % 4];
    for (int i = 0; i < kPiecesPerSide; ++i) {
      const auto ray = calib::unproject(lens, from + (to - from) * i / kPiecesPerSide);
      points.push_back(ray ? std::optional<Eigen::Vector3d>(*ray * distance) : std::nullopt);
    }
  }
  return points;
}

Marker marker(int type, const std::string& frame, const std::string& name, int id, float alpha) {
  Marker marker;
  marker.header.frame_id = frame;
  marker.ns = name;
  marker.id = id;
  marker.type = type;
  marker.pose.orientation.w = 1;
  marker.scale.x = marker.scale.y = marker.scale.z = type == Marker::TRIANGLE_LIST ? 1 : 0.006;
  marker.color.r = 1;
  marker.color.g = 0.85f;
  marker.color.b = 0.3f;
  marker.color.a = alpha;
  return marker;
}

}  // namespace

visualization_msgs::MarkerArray beamMarkers(const calib::Lens& lens, const std::string& frame,
                                            const std::string& name, double distance) {
  Marker sides = marker(Marker::TRIANGLE_LIST, frame, name, 0, kSides);
  Marker edges = marker(Marker::LINE_LIST, frame, name, 1, kEdges);
  sides.frame_locked = edges.frame_locked = 1;
  const auto points = border(lens, distance);
  const geometry_msgs::Point origin;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto &here = points[i], &next = points[(i + 1) % points.size()];
    if (here && i % kPiecesPerSide == 0) {
      edges.points.push_back(origin);
      edges.points.push_back(toPoint(*here));
    }
    if (!here || !next) continue;
    edges.points.push_back(toPoint(*here));
    edges.points.push_back(toPoint(*next));
    const auto a = toPoint(*here), b = toPoint(*next);
    for (const auto& p : {origin, a, b, origin, b, a}) sides.points.push_back(p);  // seen from both
  }
  visualization_msgs::MarkerArray array;
  array.markers = {sides, edges};
  return array;
}

visualization_msgs::MarkerArray surfaceMarkers(const std::vector<render::SurfacePatch>& surfaces,
                                               const std::string& fixed_frame) {
  visualization_msgs::MarkerArray array;
  array.markers.emplace_back();
  array.markers.back().action = Marker::DELETEALL;
  for (const render::SurfacePatch& surface : surfaces) {
    if (surface.polygon.empty()) continue;
    const int id = static_cast<int>(array.markers.size());
    Marker outline = marker(Marker::LINE_STRIP, fixed_frame, "surfaces", id, kEdges);
    for (std::size_t i = 0; i <= surface.polygon.size(); ++i) {
      const Eigen::Vector2d& corner = surface.polygon[i % surface.polygon.size()];
      outline.points.push_back(toPoint(surface.T_world_surface.matrix() *
                                       Eigen::Vector3d(corner.x(), corner.y(), 0)));
    }
    array.markers.push_back(outline);
  }
  return array;
}

}  // namespace afterglow::nodes
