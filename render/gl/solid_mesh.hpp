/// \file
/// Solid things on the GPU, drawn by what they are; what was listed last, as a robot before its
/// room, is drawn first: where it hides others, they cost nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/gl/gl_handle.hpp"
#include "render/scene/shaded_mesh.hpp"

namespace afterglow::render {

class SolidMesh {
 public:
  enum class Kind { Paint, Wood, Ghost };

  SolidMesh();

  /// Wood is what is painted in kWoodPaint, ghosts are what is translucent. False: nothing has
  /// changed.
  bool set(const std::vector<Drawable>& solids, const Eye& eye);
  bool has(Kind kind) const;
  /// Draws what is of that kind. The program's vertex shader is solid.vert.
  void draw(const Program& program, Kind kind) const;
  /// Draws all that stands in the room.
  void drawSolids(const Program& program) const;

 private:
  struct Run {
    Kind kind;
    std::size_t begin, end;  ///< indices
  };
  bool isAsBefore(const ShadedMesh& mesh, const std::vector<Run>& runs) const;

  ShadedMeshBuilder builder_;
  std::vector<Run> runs_;
  std::vector<ShadedVertex> shown_;  ///< the vertices that the buffers hold
  std::vector<std::uint32_t> shown_indices_;
  Buffer vertices_ = Buffer::make(), indices_ = Buffer::make();
  VertexArray array_;
};

}  // namespace afterglow::render
