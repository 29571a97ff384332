#include "render/scene/shaded_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace afterglow::render {
namespace {

constexpr double kSharpCosine = 0.766;  // 40 degrees

ShadedVertex shadedVertex(const Eigen::Vector3d& p, const Eigen::Vector3d& n, const Rgba& color) {
  const Eigen::Vector3f pf = p.cast<float>(), nf = n.cast<float>();
  return {pf.x(), pf.y(), pf.z(), nf.x(), nf.y(), nf.z(), color};
}

}  // namespace

const ShadedMesh& ShadedMeshBuilder::build(const std::vector<Drawable>& solids, const Eye& eye) {
  shaded_.vertices.clear();
  shaded_.indices.clear();
  shaded_.ends.clear();
  for (const Drawable& solid : solids) {
    tessellate(solid, eye, tessellation_);
    addMesh(tessellation_.mesh);
    shaded_.ends.push_back(shaded_.indices.size());
  }
  return shaded_;
}

/// Corners of a point whose normals come out alike share a vertex.
void ShadedMeshBuilder::addMesh(const Mesh& mesh) {
  findFaces(mesh);
  const std::size_t first_corner = shaded_.indices.size();
  shaded_.indices.resize(first_corner + 3 * mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.points.size(); ++i) {
    const std::size_t first_of_point = shaded_.vertices.size();
    for (const std::uint32_t face : faces_of_[i]) {
      const std::uint32_t index = addVertex(
          shadedVertex(mesh.points[i], cornerNormal(i, face), mesh.colors[i]), first_of_point);
      for (std::size_t k = 0; k < 3; ++k) {
        if (mesh.triangles[face][k] == i) shaded_.indices[first_corner + 3 * face + k] = index;
      }
    }
  }
}

void ShadedMeshBuilder::findFaces(const Mesh& mesh) {
  face_normals_.clear();
  if (faces_of_.size() < mesh.points.size()) faces_of_.resize(mesh.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i) faces_of_[i].clear();
  for (std::uint32_t face = 0; face < mesh.triangles.size(); ++face) {
    const auto& t = mesh.triangles[face];
    const Eigen::Vector3d &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
    face_normals_.push_back((b - a).cross(c - a));
    for (const std::uint32_t i : t) faces_of_[i].push_back(face);
  }
}

/// Returns the normal of the faces around the point that bend little against this one, by their
/// areas.
Eigen::Vector3d ShadedMeshBuilder::cornerNormal(std::uint32_t point, std::uint32_t face) const {
  const Eigen::Vector3d own = face_normals_[face].normalized();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const std::uint32_t other : faces_of_[point]) {
    if (own.dot(face_normals_[other].normalized()) > kSharpCosine) sum += face_normals_[other];
  }
  return sum.norm() > 0 ? Eigen::Vector3d(sum.normalized()) : own;
}

std::uint32_t ShadedMeshBuilder::addVertex(const ShadedVertex& vertex, std::size_t first_of_point) {
  const auto isAlike = [&](const ShadedVertex& other) {
    return std::abs(other.nx - vertex.nx) + std::abs(other.ny - vertex.ny) +
               std::abs(other.nz - vertex.nz) <
           1e-3f;
  };
  std::vector<ShadedVertex>& vertices = shaded_.vertices;
  const auto found = std::find_if(vertices.begin() + static_cast<std::ptrdiff_t>(first_of_point),
                                  vertices.end(), isAlike);
  const auto index = static_cast<std::uint32_t>(found - vertices.begin());
  if (found == vertices.end()) vertices.push_back(vertex);
  return index;
}

}  // namespace afterglow::render
