/// \file
/// Content laid on a surface's relief instead of its plane.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "render/scene/mesh.hpp"
#include "render/scene/relief.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

struct LaidMesh {
  Mesh mesh;                    ///< world; on the relief
  std::vector<double> heights;  ///< heights over the plane; higher hides lower
};

/// Lays content on a relief. Drape: along the plane's normal. Viewer: where the ray from the
/// viewer's eye through the content first meets the relief. What would land in a hole, outside the
/// relief, or where the relief itself is in the way of the light or of the viewer's eye, is left
/// out: to the share of a cell that the nodes around it tell. Remembers what it found out about
/// nodes. Any thread.
class ReliefPlacer {
 public:
  /// Heights this near to the place where light is to land, meters, do not stop it: noise.
  static constexpr double kTouch = 0.01;

  /// Takes a layer, and the place that the light comes from (world). Throws std::logic_error if the
  /// layer has no relief or is not placed on a surface.
  ReliefPlacer(const Layer& layer, const Eigen::Vector3d& p_light);

  /// Returns true if a placer of these would place everything as this one does.
  bool isFor(const Layer& layer, const Eigen::Vector3d& p_light) const;

  double cell() const { return relief_->cell(); }

  /// Returns the place where a point of the content lands. World coordinates.
  std::optional<Eigen::Vector3d> place(const Eigen::Vector3d& p_world) const;

  /// Replaces what `out` held. The relief's triangles are cut to the shadows of the mesh's on them.
  void lay(const Mesh& mesh, LaidMesh& out) const;

 private:
  /// A corner of the content, in the surface's frame as all here.
  struct Vertex {
    Eigen::Vector3d p;
    Eigen::Vector4f color;
  };
  /// A triangle of the content.
  struct Content {
    std::array<const Vertex*, 3> corners;
    /// Maps a place on the relief to the shares of the corners that are laid there; outside, some
    /// are negative.
    Eigen::Matrix<double, 3, 4> shares;
  };
  /// A place on the relief: the content's shares of it, and the node's clearance. All of them are
  /// linear on a triangle of the relief; one below zero is outside.
  struct Corner {
    Eigen::Vector3d p;
    Eigen::Vector4d inside;
  };
  struct Polygon {
    /// A triangle's; a cut makes one more of them, with rounding at most half as many more.
    std::array<Corner, 13> corners;
    std::size_t count = 0;
  };
  struct Cells {
    Eigen::Array2i first, last;
  };

  Eigen::Vector3d inSurface(const Eigen::Vector3d& p_world) const;
  double clearance(int column, int row) const;
  std::optional<Eigen::Vector3d> landing(const Eigen::Vector3d& p) const;
  std::optional<Content> contentOf(const std::array<const Vertex*, 3>& corners) const;
  std::optional<Cells> cellsUnder(const Content& content) const;
  void layOn(int column, int row, const Content& content, LaidMesh& out) const;
  bool isStretched(const Corner& a, const Corner& b, const Corner& c) const;
  static void cut(Eigen::Index side, Polygon& polygon);
  void add(const Polygon& polygon, const Content& content, LaidMesh& out) const;

  std::shared_ptr<const Relief> relief_;
  Placement placement_;
  Eigen::Isometry3d T_world_surface_;
  Eigen::Vector3d p_world_light_, p_world_viewer_;
  Eigen::Vector3d p_light_;
  std::optional<Eigen::Vector3d> p_eye_;  ///< absent: content is laid along z
  /// Each node's clearance on the light's way or the eye's, the lower one; not a number: not yet
  /// looked at.
  mutable std::vector<std::atomic<float>> clearances_;
};

}  // namespace afterglow::render
