#include "render/gl/solid_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

#include "render/gl/observer_renderer.hpp"
#include "render/gl/shader.hpp"

namespace afterglow::render {
namespace {

bool isWood(const Color& color) {
  constexpr float kNear = 0.004f;  // bytes round
  return std::abs(color.r - kWoodPaint.r) < kNear && std::abs(color.g - kWoodPaint.g) < kNear &&
         std::abs(color.b - kWoodPaint.b) < kNear;
}

SolidMesh::Kind kindOf(const Drawable& solid) {
  if (solid.color.a < 0.999f) return SolidMesh::Kind::Ghost;
  return isWood(solid.color) ? SolidMesh::Kind::Wood : SolidMesh::Kind::Paint;
}

}  // namespace

SolidMesh::SolidMesh() : array_(makeVertexArray<ShadedVertex>(vertices_)) {
  glVertexArrayElementBuffer(array_.id(), indices_.id());
  setAttribute<glm::vec3>(array_, 0, offsetof(ShadedVertex, x));
  setAttribute<glm::vec3>(array_, 1, offsetof(ShadedVertex, nx));
  setAttribute<glm::u8vec4>(array_, 2, offsetof(ShadedVertex, color));
}

bool SolidMesh::set(const std::vector<Drawable>& solids, const Eye& eye) {
  const std::vector<Drawable> all(solids.rbegin(), solids.rend());
  const ShadedMesh& mesh = builder_.build(all, eye);
  std::vector<Run> runs;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Kind kind = kindOf(all[i]);
    if (runs.empty() || runs.back().kind != kind) runs.push_back({kind, begin, begin});
    runs.back().end = begin = mesh.ends[i];
  }
  if (isAsBefore(mesh, runs)) return false;
  runs_ = std::move(runs);
  shown_ = mesh.vertices;
  shown_indices_ = mesh.indices;
  upload(vertices_, mesh.vertices);
  upload(indices_, mesh.indices);
  return true;
}

bool SolidMesh::isAsBefore(const ShadedMesh& mesh, const std::vector<Run>& runs) const {
  const auto is_same_run = [](const Run& a, const Run& b) {
    return a.kind == b.kind && a.begin == b.begin && a.end == b.end;
  };
  static_assert(sizeof(ShadedVertex) == 28, "no byte between its members");
  return std::equal(runs.begin(), runs.end(), runs_.begin(), runs_.end(), is_same_run) &&
         mesh.indices == shown_indices_ && mesh.vertices.size() == shown_.size() &&
         std::memcmp(mesh.vertices.data(), shown_.data(),
                     shown_.size() * sizeof(ShadedVertex)) == 0;
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
