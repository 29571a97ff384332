/// \file
/// Shapes into triangles and points. Sizes and forms are RViz's (scene.hpp).
#pragma once

#include <optional>
#include <vector>

#include "render/scene/mesh.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// Where flat things (lines, squares) turn to.
struct Eye {
  /// x right, y down, z forward: squares lie parallel to x and y.
  Eigen::Matrix3d R_world_eye = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  bool parallel = false;  ///< looks along z from everywhere instead of from p_world
  /// Letters stand before p_world, upright against z, instead of parallel to x and y.
  bool letters_face_it = false;
  std::optional<Reader> reader;  ///< letters turn to him in the plane of x and y
  /// More than 0: what is made is for nobody else, so that what faces away is left out, and so
  /// round that pixels of a lens at p_lens do not show corners. 0: whole bodies.
  double focal_px = 0;
  Eigen::Vector3d p_lens = Eigen::Vector3d::Zero();
};

/// Direct: the projector. Drape and Viewer: flat things lie parallel to the surface, facing along
/// its normal or towards the viewer.
Eye eyeOfLayer(const Layer& layer, const Rigid<Projector, World>& T_projector_world,
               double focal_px);

/// A line of so many pixels' width.
struct ThinLine {
  Eigen::Vector3d from, to;  ///< world
  Rgba from_color, to_color;
  double width_px;
};

/// Reused from drawable to drawable, so that steady scenes allocate nothing.
struct Tessellation {
  Mesh mesh;
  std::vector<Splat> splats;         ///< PointStyle::Points only
  std::vector<ThinLine> thin_lines;  ///< Lines with width_px only
  /// Of something flat, all of one color: edges between the mesh's points. Null: not known to be.
  const std::vector<std::array<std::uint32_t, 2>>* outline = nullptr;
};

/// Replaces what `out` held. Points that are not finite are left out, and so is what they belong
/// to.
void tessellate(const Drawable& drawable, const Eye& eye, Tessellation& out);

}  // namespace afterglow::render
