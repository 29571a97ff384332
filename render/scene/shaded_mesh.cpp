#include "render/scene/shaded_mesh.hpp"

#include <Eigen/Geometry>

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
  for (const Drawable& solid : solids) {
    tessellate(solid, eye, tessellation_);
    addMesh(tessellation_.mesh);
  }
  return shaded_;
}

/// A corner's normal is that of the faces around its point that bend little against its own face;
/// corners of a point that come out alike share a vertex.
void ShadedMeshBuilder::addMesh(const Mesh& mesh) {
  face_normals_.clear();
  if (faces_of_.size() < mesh.points.size()) faces_of_.resize(mesh.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i) faces_of_[i].clear();
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto& t = mesh.triangles[f];
    const Eigen::Vector3d &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
    face_normals_.push_back((b - a).cross(c - a));  // as long as twice the area
    for (const std::uint32_t i : t) faces_of_[i].push_back(static_cast<std::uint32_t>(f));
  }
  const auto base = static_cast<std::uint32_t>(shaded_.vertices.size());
  shaded_.indices.resize(shaded_.indices.size() + 3 * mesh.triangles.size());
  std::uint32_t* corners =
      shaded_.indices.data() + shaded_.indices.size() - 3 * face_normals_.size();
  std::uint32_t next = base;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const std::uint32_t first_of_point = next;
    for (const std::uint32_t f : faces_of_[i]) {
      const Eigen::Vector3d own = face_normals_[f].normalized();
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (const std::uint32_t g : faces_of_[i]) {
        if (own.dot(face_normals_[g].normalized()) > kSharpCosine) sum += face_normals_[g];
      }
      const ShadedVertex vertex = shadedVertex(
          mesh.points[i], sum.norm() > 0 ? Eigen::Vector3d(sum.normalized()) : own, mesh.colors[i]);
      std::uint32_t index = first_of_point;
      const auto alike = [&](const ShadedVertex& other) {
        return std::abs(other.nx - vertex.nx) + std::abs(other.ny - vertex.ny) +
                   std::abs(other.nz - vertex.nz) <
               1e-3f;
      };
      while (index < next && !alike(shaded_.vertices[index])) ++index;
      if (index == next) {
        shaded_.vertices.push_back(vertex);
        ++next;
      }
      const auto& t = mesh.triangles[f];
      for (std::size_t k = 0; k < 3; ++k) {
        if (t[k] == i) corners[3 * f + k] = index;
      }
    }
  }
}

}  // namespace afterglow::render
