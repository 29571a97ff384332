/// \file
/// Shapes as triangles in the projector's optical frame, cut to the part that its lens shows, and
/// split until the lens shows their edges straight. Both back ends draw them.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "render/compose/composed_image.hpp"
#include "render/scene/cut.hpp"
#include "render/scene/mesh.hpp"
#include "render/scene/tessellate.hpp"

namespace afterglow::render {

/// A vertex as it is uploaded.
struct LightVertex {
  float x, y, z;  ///< optical frame, meters
  float depth;    ///< -1 (drawn over the rest) to 1; linear on the image
  Rgba color;
};
LightVertex lightVertex(const CutVertex& vertex, const Placed& placed);

/// Triangles, in `indices`, whose even-odd union is an outline.
struct LightOutline {
  std::uint32_t first = 0, count = 0;
};
struct LightMask {
  std::optional<LightOutline> outline;  ///< absent: the surface is endless
  std::vector<LightOutline> shades;     ///< surfaces before it
};

struct LightTriangles {
  std::vector<LightVertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<LightMask> masks;

  /// Replaces all by the masks of an image.
  void begin(const ComposedImage& image);
};

/// Projects steps one after the other: place() a step, look at it, add() it. Keeps its buffers.
class TriangleProjector {
 public:
  explicit TriangleProjector(const calib::Lens& lens) : domain_(lens), cutter_(domain_) {}
  TriangleProjector(const TriangleProjector&) = delete;
  TriangleProjector& operator=(const TriangleProjector&) = delete;

  /// The layer must outlive the step.
  void place(const Drawable& drawable, const ComposedLayer& layer);

  /// The tessellation of the step; without vertices nothing of its mesh is seen.
  const Tessellation& tessellation() const { return tessellation_; }
  const std::vector<CutVertex>& vertices() const { return vertices_; }
  /// Returns true if the lens shows all of the mesh.
  bool isWhole() const { return is_whole_; }
  /// Width and height on the image, if it shows all.
  Eigen::Vector2d sizePx() const { return seen_.sizes().cwiseProduct(domain_.focal()); }
  const LensDomain& domain() const { return domain_; }

  /// Appends the step's triangles and thin lines; absent if nothing of them is seen.
  std::optional<Piece> add(LightTriangles& out);

 private:
  void placeVertices(const Mesh& mesh);
  /// Returns true if the lens shows the edge between two vertices straight.
  bool isStraight(const CutVertex& a, const CutVertex& b) const;
  void addMesh(LightTriangles& out);
  void addThinLine(const ThinLine& line, LightTriangles& out);
  void addCut(const CutVertex& a, const CutVertex& b, const CutVertex& c, LightTriangles& out);
  std::uint32_t addVertex(const CutVertex& vertex, LightTriangles& out) const;

  LensDomain domain_;
  TriangleCutter cutter_;
  Tessellation tessellation_;
  LaidMesh laid_;
  const ComposedLayer* layer_ = nullptr;
  const Mesh* mesh_ = nullptr;
  std::vector<CutVertex> vertices_, thin_;
  std::vector<char> inside_;  ///< a flag for each vertex
  bool is_whole_ = false, is_small_ = false;
  Eigen::AlignedBox2d seen_;  ///< normalized
  std::vector<std::uint32_t> index_of_;
};

}  // namespace afterglow::render
