/// \file
/// Triangles cut to what a lens can show, and split until it shows their edges straight.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "render/scene/lens_domain.hpp"
#include "render/scene/mesh.hpp"

namespace afterglow::render {

/// A vertex on its way to the image.
struct CutVertex {
  /// Optical frame, meters, homogeneous: a projective placement has not been divided yet.
  Eigen::Vector4d p_optical;
  Eigen::Vector4f color;  ///< Rgba's components
  double height = 0;      ///< height over the surface it is placed on, meters, before the placement
};

/// Returns true if a vertex lies within all bounds, and thus a triangle of such vertices needs no
/// cutting.
bool isInside(const LensDomain& domain, const CutVertex& vertex);

/// Bits of the domain's borders that a vertex lies beyond; a shape with all its vertices beyond one
/// border is not seen.
unsigned bordersBeyond(const LensDomain& domain, const CutVertex& vertex);

/// Normalized coordinates of a vertex in front of the lens.
inline Eigen::Vector2d normalized(const CutVertex& vertex) {
  return vertex.p_optical.head<2>() / vertex.p_optical.z();
}

/// The vertex at a share of the way.
CutVertex mixed(const CutVertex& from, const CutVertex& to, double share);

/// Keeps its buffers between calls.
class TriangleCutter {
 public:
  explicit TriangleCutter(const LensDomain& domain) : domain_(domain) {}

  /// Triangles, three vertices each, that cover the seen part of the given one; with w = 1.
  /// Valid until the next call. Neighbors that share an edge share its cuts and splits exactly.
  const std::vector<CutVertex>& cut(const CutVertex& a, const CutVertex& b, const CutVertex& c);

  /// The seen part of a closed outline, convex or not, with enough corners; with w = 1. What is
  /// inside by the even-odd rule stays so. Valid until the next call.
  const std::vector<CutVertex>& cutOutline(const std::vector<CutVertex>& corners);

 private:
  void clipToDomain();
  void splitEdge(const CutVertex& from, const CutVertex& to, int depth);
  template <typename Distance>
  void clip(Distance distance);
  void clipToFold();
  void split(const CutVertex& a, const CutVertex& b, const CutVertex& c, int depth);

  const LensDomain& domain_;
  std::vector<CutVertex> polygon_, clipped_, output_;
};

}  // namespace afterglow::render
