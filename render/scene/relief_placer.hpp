/// \file
/// Content laid on a surface's relief instead of its plane.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "render/scene/mesh.hpp"
#include "render/scene/relief.hpp"
#include "render/scene/relief_facets.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

struct LaidMesh {
  Mesh mesh;                    ///< world; on the relief
  std::vector<double> heights;  ///< of the content over the surface's plane, one a point: higher
                                ///< content hides lower content
};

/// Drape: along the plane's normal. Viewer: where the ray from the viewer's eye through the content
/// first meets the relief. What would land in a hole, outside the relief, or where the light does
/// not reach because the relief itself is in its way, is left out. Keeps its buffers, and what it
/// found out about the relief as long as that, the light and the viewer stay.
class ReliefPlacer {
 public:
  /// Which layer follows, and where the light comes from (world). Throws std::logic_error if it has
  /// no relief or is not placed on a surface.
  void begin(const Layer& layer, const Eigen::Vector3d& p_light);

  double cell() const { return relief_->cell(); }

  /// Where a point of the content lands. World coordinates.
  std::optional<Eigen::Vector3d> place(const Eigen::Vector3d& p_world) const;

  /// Replaces what `out` held. The relief's facets are cut to the triangles' shadows on them:
  /// exact, but for what the facets leave out (ReliefFacets). Neighbors share their vertices.
  void lay(const Mesh& mesh, LaidMesh& out);

 private:
  struct Vertex {
    Eigen::Vector3d p;  ///< content; surface's frame, as all here
    Eigen::Vector4f color;
  };
  /// Where an edge of the content is cast.
  struct Side {
    Eigen::Vector3d normal, origin;
    double rounding;  ///< less is zero

    double at(const Eigen::Vector3d& p) const {
      const double distance = normal.dot(p - origin);
      return std::abs(distance) <= rounding ? 0 : distance;
    }
  };
  /// Positive on the inside; together, a triangle's shares of its corners.
  using Shares = std::array<double, 3>;
  struct Content {
    std::array<const Vertex*, 3> corners;
    std::array<Side, 3> sides;  ///< each opposite the corner of its number
    Shares at(const Eigen::Vector3d& p) const {
      return {sides[0].at(p), sides[1].at(p), sides[2].at(p)};
    }
  };
  /// A facet being cut. Lines are the facet's edges, and after them the content's.
  struct Corner {
    Eigen::Vector3d p;
    Shares shares;
    std::size_t line;  ///< to the next corner
  };
  using Facet = std::array<Eigen::Vector3d, 3>;

  std::optional<Eigen::Vector3d> landing(const Eigen::Vector3d& p) const;
  std::optional<Eigen::Vector3d> spotOf(const Eigen::Vector3d& p) const;
  double highest() const;
  void layBelowEye(const std::array<std::uint32_t, 3>& triangle);
  void layTriangle(const Vertex& a, const Vertex& b, const Vertex& c);
  Side sideOf(const Vertex& a, const Vertex& b, const Vertex& opposite) const;
  void findFootprint(const Content& content);
  std::array<double, 2> columnsIn(int row) const;
  void layOn(const ReliefFacets::Cell& cell, const Content& content);
  void cut(const Facet& facet, const Content& content);
  void cutOff(std::size_t side, const Facet& facet, const Content& content);
  Eigen::Vector3d crossing(std::size_t line, std::size_t side, const Facet& facet,
                           const Content& content) const;
  Eigen::Vector3d landingOn(const Facet& facet, const Eigen::Vector3d& p) const;
  std::uint32_t add(const Eigen::Vector3d& p, const Shares& shares, const Content& content);

  std::shared_ptr<const Relief> relief_;
  ReliefFacets facets_;
  Eigen::Isometry3d T_world_surface_ = Eigen::Isometry3d::Identity();
  Eigen::Vector3d p_light_ = Eigen::Vector3d::Zero();
  ReliefCast cast_;
  std::vector<Vertex> vertices_;
  std::vector<Eigen::Vector2d> footprint_;  ///< its hull holds the triangle's; in cells
  std::vector<Shares> shares_;              ///< of a cell's corners
  std::vector<std::uint32_t> index_of_;     ///< in the output
  std::vector<Corner> polygon_, clipped_;
  LaidMesh* out_ = nullptr;
};

}  // namespace afterglow::render
