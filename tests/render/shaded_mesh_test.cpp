#include "render/scene/shaded_mesh.hpp"

#include <gtest/gtest.h>

namespace afterglow::render::shaded_mesh_test {
namespace {

ShadedMesh build(Shape shape) {
  return ShadedMeshBuilder().build({{{}, std::move(shape), {}}}, {});
}

Eigen::Vector3d normal(const ShadedVertex& v) { return {v.nx, v.ny, v.nz}; }

TEST(ShadedMesh, cubesHaveSharpEdges) {
  const ShadedMesh mesh = build(Cube{});
  EXPECT_EQ(mesh.vertices.size(), 24u);
  EXPECT_EQ(mesh.indices.size(), 36u);
  for (const ShadedVertex& v : mesh.vertices) {
    EXPECT_NEAR(normal(v).cwiseAbs().maxCoeff(), 1, 1e-6) << "along an axis";
    EXPECT_GT(normal(v).dot(Eigen::Vector3d(v.x, v.y, v.z)), 0) << "outwards";
  }
}

TEST(ShadedMesh, spheresAreRound) {
  for (const ShadedVertex& v : build(Sphere{}).vertices) {
    const Eigen::Vector3d radial = Eigen::Vector3d(v.x, v.y, v.z).normalized();
    EXPECT_GT(normal(v).dot(radial), 0.99);
  }
}

TEST(ShadedMesh, cylindersAreRoundWithFlatEnds) {
  for (const ShadedVertex& v : build(Cylinder{}).vertices) {
    const Eigen::Vector3d n = normal(v);
    const bool end = std::abs(n.z()) > 0.999;
    const bool side = std::abs(n.z()) < 1e-6 && n.dot(Eigen::Vector3d(v.x, v.y, 0)) > 0.49;
    EXPECT_TRUE(end || side) << n.transpose();
  }
}

TEST(ShadedMesh, severalSolidsKeepTheirCorners) {
  ShadedMeshBuilder builder;
  Triangles triangle;
  triangle.points = {{0, 0, 5}, {1, 0, 5}, {0, 1, 5}};
  const ShadedMesh& mesh =
      builder.build({{{}, Sphere{}, {}}, {{}, triangle, {1, 0, 0, 1}}, {{}, Cube{}, {}}}, {});
  const std::size_t corner = mesh.indices.size() - 36 - 3;
  for (std::size_t k = 0; k < 3; ++k) {
    const ShadedVertex& v = mesh.vertices[mesh.indices[corner + k]];
    EXPECT_EQ(Eigen::Vector3f(v.x, v.y, v.z), triangle.points[k]);
    EXPECT_EQ(v.color, (Rgba{255, 0, 0, 255}));
  }
}

}  // namespace
}  // namespace afterglow::render::shaded_mesh_test
