/// \file
/// Content laid on a surface's relief instead of its plane.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "render/scene/mesh.hpp"
#include "render/scene/relief.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

struct LaidMesh {
  Mesh mesh;                    ///< world; on the relief
  std::vector<double> heights;  ///< of the content over the surface's plane, one a point: higher
                                ///< content hides lower content
};

/// Drape: along the plane's normal. Viewer: where the ray from the viewer's eye through the content
/// first meets the relief. What would land in a hole, outside the relief, or where the light does
/// not reach because the relief itself is in its way, is left out. Keeps its buffers.
class ReliefPlacer {
 public:
  /// Which layer follows, and where the light comes from (world). The layer must outlive its
  /// placing. Throws std::logic_error if it has no relief or is not placed on a surface.
  void begin(const Layer& layer, const Eigen::Vector3d& p_light);

  double cell() const { return relief_->cell(); }

  /// Where a point of the content lands. World coordinates.
  std::optional<Eigen::Vector3d> place(const Eigen::Vector3d& p_world) const;

  /// Replaces what `out` held. Triangles are split until they follow the relief to kTolerance, and
  /// near steps, holes and shadows to an eighth of a cell; neighbors that share an edge share its
  /// splits.
  void lay(const Mesh& mesh, LaidMesh& out);

  static constexpr double kTolerance = 0.0005;  ///< meters

 private:
  struct Vertex {
    Eigen::Vector3d p;  ///< content; surface's frame, as all here
    Eigen::Vector4f color;
    Eigen::Vector2d foot;                 ///< on the lowest plane of the relief
    std::optional<Eigen::Vector3d> spot;  ///< on the relief; absent: dark
    std::uint32_t index;                  ///< in the output, once it is there
  };
  /// Between two vertices; found once, for both triangles that it belongs to.
  struct Edge {
    double allowed = 0;     ///< how long it may be on the ground
    bool is_empty = false;  ///< nothing is known around it
    std::uint32_t middle;   ///< a vertex, once it is there
  };
  struct Slot {
    std::uint64_t key;  ///< both vertices, the lesser one first; kFree: none
    Edge edge;
  };
  static constexpr std::uint64_t kFree = ~std::uint64_t{0};
  using Triangle = std::array<std::uint32_t, 3>;

  std::optional<Eigen::Vector3d> landing(const Eigen::Vector3d& p) const;
  std::optional<Eigen::Vector3d> spotOf(const Eigen::Vector3d& p) const;
  Eigen::Vector2d footOf(const Eigen::Vector3d& p, double height) const;
  std::uint32_t addVertex(const Eigen::Vector3d& p, const Eigen::Vector4f& color);
  std::uint32_t addBetween(std::uint32_t a, std::uint32_t b, double share);
  void layBelowEye(const Triangle& triangle);
  void split(const Triangle& triangle, int depth);
  /// Until the next edge is asked for.
  Edge& edge(std::uint32_t a, std::uint32_t b);
  void forgetEdges();
  Slot& slotOf(std::uint64_t key);
  void doubleSlots();
  std::uint32_t middle(Edge& edge, std::uint32_t a, std::uint32_t b);
  void judge(Edge& edge, std::uint32_t a, std::uint32_t b);
  void add(const Triangle& triangle);

  const Relief* relief_ = nullptr;
  Eigen::Isometry3d T_world_surface_ = Eigen::Isometry3d::Identity();
  Eigen::Vector3d p_light_ = Eigen::Vector3d::Zero(), p_eye_ = Eigen::Vector3d::Zero();
  bool has_eye_ = false;
  std::vector<Vertex> vertices_;
  /// By open addressing, a power of two of them: some hundred thousand edges an image are not worth
  /// an allocation each.
  std::vector<Slot> slots_;
  std::size_t edge_count_ = 0;
  LaidMesh* out_ = nullptr;
};

}  // namespace afterglow::render
