#include "render/gl/solid_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>

#include "render/gl/observer_renderer.hpp"
#include "render/gl/shader.hpp"
#include "render/scene/ghost_outline.hpp"

namespace afterglow::render {
namespace {

bool isWood(const Color& color) {
  constexpr float kNear = 0.004f;  // bytes round
  return std::abs(color.r - kWoodPaint.r) < kNear && std::abs(color.g - kWoodPaint.g) < kNear &&
         std::abs(color.b - kWoodPaint.b) < kNear;
}

SolidMesh::Kind kindOf(const Drawable& solid) {
  if (isGhost(solid)) return SolidMesh::Kind::Ghost;
  return isWood(solid.color) ? SolidMesh::Kind::Wood : SolidMesh::Kind::Paint;
}

WorldBox boundsOf(const std::vector<ShadedVertex>& vertices) {
  if (vertices.empty()) return {};
  const auto at = [](const ShadedVertex& vertex) {
    return glm::dvec3(vertex.x, vertex.y, vertex.z);
  };
  WorldBox box{at(vertices.front()), at(vertices.front())};
  for (const ShadedVertex& vertex : vertices) {
    box.low = glm::min(box.low, at(vertex));
    box.high = glm::max(box.high, at(vertex));
  }
  return box;
}

}  // namespace

SolidMesh::SolidMesh() : array_(makeVertexArray<ShadedVertex>(vertices_)) {
  glVertexArrayElementBuffer(array_.id(), indices_.id());
  setAttribute<glm::vec3>(array_, 0, offsetof(ShadedVertex, x));
  setAttribute<glm::vec3>(array_, 1, offsetof(ShadedVertex, nx));
  setAttribute<glm::u8vec4>(array_, 2, offsetof(ShadedVertex, color));
}

void SolidMesh::set(const std::vector<Drawable>& solids, const Eye& eye) {
  std::vector<Drawable> all = ghostOutlines(solids, eye);
  const std::size_t outlines = all.size();
  all.insert(all.end(), solids.begin(), solids.end());
  const ShadedMesh& mesh = builder_.build(all, eye);
  runs_.clear();
  std::size_t begin = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    add(i < outlines ? Kind::Outline : kindOf(all[i]), begin, mesh.ends[i]);
    begin = mesh.ends[i];
  }
  bounds_ = boundsOf(mesh.vertices);
  upload(vertices_, mesh.vertices);
  upload(indices_, mesh.indices);
}

void SolidMesh::add(Kind kind, std::size_t begin, std::size_t end) {
  if (!runs_.empty() && runs_.back().kind == kind) {
    runs_.back().end = end;
  } else {
    runs_.push_back({kind, begin, end});
  }
}

bool SolidMesh::has(Kind kind) const {
  return std::any_of(runs_.begin(), runs_.end(),
                     [kind](const Run& run) { return run.kind == kind; });
}

void SolidMesh::draw(const Program& program, Kind kind) const {
  glUseProgram(program.id());
  glBindVertexArray(array_.id());
  for (const Run& run : runs_) {
    if (run.kind != kind) continue;
    const std::uintptr_t offset = run.begin * sizeof(std::uint32_t);
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(run.end - run.begin), GL_UNSIGNED_INT,
                   reinterpret_cast<const void*>(offset));
  }
}

void SolidMesh::drawSolids(const Program& program) const {
  draw(program, Kind::Paint);
  draw(program, Kind::Wood);
}

}  // namespace afterglow::render
