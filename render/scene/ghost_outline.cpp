#include "render/scene/ghost_outline.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include "render/scene/tessellate.hpp"

namespace afterglow::render {
namespace {

constexpr double kBentCosine = 0.766;               // 40 degrees
constexpr double kDash_m = 0.022, kGap_m = 0.014;   // along an edge
constexpr double kWidthOfDistance = 0.0022;         // of a dash: about two pixels

struct EdgeFaces {
  Eigen::Vector3d first = Eigen::Vector3d::Zero(), second = Eigen::Vector3d::Zero();
  int count = 0;
};
using EdgesOfMesh = std::map<std::pair<std::uint32_t, std::uint32_t>, EdgeFaces>;

EdgesOfMesh edgesOf(const Mesh& mesh) {
  EdgesOfMesh edges;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d& a = mesh.points[t[0]];
    const Eigen::Vector3d normal =
        (mesh.points[t[1]] - a).cross(mesh.points[t[2]] - a).normalized();
    for (std::size_t i = 0; i < 3; ++i) {
      EdgeFaces& faces = edges[std::minmax(t[i], t[(i + 1) % 3])];
      (faces.count++ == 0 ? faces.first : faces.second) = normal;
    }
  }
  return edges;
}

/// Seen as a line: a corner, a border, or where the body turns away.
bool isOutline(const EdgeFaces& faces, const Eigen::Vector3d& to_eye) {
  if (faces.count != 2 || std::abs(faces.first.dot(faces.second)) < kBentCosine) return true;
  return faces.first.dot(to_eye) * faces.second.dot(to_eye) < 0;
}

void addDashes(const Eigen::Vector3d& from, const Eigen::Vector3d& to, PointList& points) {
  const double length = (to - from).norm();
  const auto count = static_cast<int>(std::ceil(std::min(length, 50.0) / (kDash_m + kGap_m)));
  for (int i = 0; i < count; ++i) {
    // Half a dash at each end: corners are closed.
    const double middle = count > 1 ? static_cast<double>(i) / (count - 1) : 0.5;
    const double half = kDash_m / 2 / length;
    const double begin = std::max(middle - half, 0.0), end = std::min(middle + half, 1.0);
    points.push_back((from + begin * (to - from)).cast<float>());
    points.push_back((from + end * (to - from)).cast<float>());
  }
}

}  // namespace

bool isGhost(const Drawable& drawable) { return drawable.color.a < 0.999f; }

std::vector<Drawable> ghostOutlines(const std::vector<Drawable>& solids, const Eye& eye) {
  std::vector<Drawable> outlines;
  Tessellation made;
  for (const Drawable& solid : solids) {
    if (!isGhost(solid)) continue;
    tessellate(solid, eye, made);
    if (made.mesh.points.empty()) continue;
    Lines dashes;
    dashes.strip = false;
    const Eigen::Vector3d to_eye = eye.p_world - made.mesh.points.front();
    dashes.width = static_cast<float>(kWidthOfDistance * to_eye.norm());
    for (const auto& [ends, faces] : edgesOf(made.mesh)) {
      const Eigen::Vector3d& from = made.mesh.points[ends.first];
      const Eigen::Vector3d& to = made.mesh.points[ends.second];
      if ((to - from).norm() > 1e-4 && isOutline(faces, eye.p_world - from)) {
        addDashes(from, to, dashes.points.edit());
      }
    }
    if (!dashes.points.empty()) outlines.push_back({{}, dashes, {}});
  }
  return outlines;
}

}  // namespace afterglow::render
