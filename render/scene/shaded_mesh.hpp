/// \file
/// Solid things as triangles with normals, for a lit room.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/scene/mesh.hpp"
#include "render/scene/scene.hpp"
#include "render/scene/tessellate.hpp"

namespace afterglow::render {

/// A vertex as it is uploaded.
struct ShadedVertex {
  float x, y, z;     ///< world, meters
  float nx, ny, nz;  ///< unit normal; which side it points to says nothing
  Rgba color;
};

struct ShadedMesh {
  std::vector<ShadedVertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<std::size_t> ends;  ///< ends of each drawable among the indices
};

/// Keeps its buffers from frame to frame.
class ShadedMeshBuilder {
 public:
  /// All drawables, opaque. Edges that bend by more than 40 degrees are sharp, others are rounded.
  /// Flat things face `eye`; PointStyle::Points, which has no size in a room, is left out.
  const ShadedMesh& build(const std::vector<Drawable>& solids, const Eye& eye);

 private:
  void addMesh(const Mesh& mesh);
  void findFaces(const Mesh& mesh);
  Eigen::Vector3d cornerNormal(std::uint32_t point, std::uint32_t face) const;
  std::uint32_t addVertex(const ShadedVertex& vertex, std::size_t first_of_point);

  Tessellation tessellation_;
  ShadedMesh shaded_;
  std::vector<Eigen::Vector3d> face_normals_;         ///< normals as long as twice the area
  std::vector<std::vector<std::uint32_t>> faces_of_;  ///< faces by point
};

}  // namespace afterglow::render
