/// \file
/// visualization_msgs/Marker -> a drawable, with its letters and meshes. Semantics: RViz 1.14's
/// marker display (marker_utils.cpp, markers/*.cpp), but faulty markers that RViz draws as garbage
/// are refused.
#pragma once

#include <visualization_msgs/Marker.h>

#include <Eigen/Geometry>
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/conversion/mesh_library.hpp"
#include "render/scene/scene.hpp"
#include "render/scene/typeface.hpp"

namespace afterglow::nodes {

/// Opens the font with the first text. One thread at a time, except for meshes().
class MarkerAssets {
 public:
  static constexpr std::size_t kMostLetters = 4096;  ///< limit of one text; more is refused

  /// `mesh_roots`: as MeshLibrary's.
  explicit MarkerAssets(std::vector<std::string> mesh_roots = {})
      : meshes_(std::move(mesh_roots)) {}

  /// UTF-8; other bytes become replacement characters. Refused: more than kMostLetters, and any
  /// text on a machine without a font. Equal texts share their letters while they are shown.
  /// Remark: characters that no font has, and the package that has most of them.
  Converted<render::SharedBody> text(const std::string& text, double capital_height);
  MeshLibrary& meshes() { return meshes_; }

 private:
  void forgetUnseen();

  std::unique_ptr<render::Typeface> typeface_;
  struct Known {
    std::weak_ptr<const render::Body> letters;
    std::string remark;
  };
  std::map<std::pair<std::string, double>, Known> texts_;
  std::size_t sweep_at_ = 64;  ///< number of texts at which those not shown any more are forgotten
  MeshLibrary meshes_;
};

/// The drawable of an ADDed marker; its pose leads from shape coordinates to the frame of the
/// marker's header. Action, lifetime and frame are left to the caller.
///
/// Fields that a type does not use are not looked at, as in RViz (checkMarkerMsg): of `scale` all
/// but x of lines, z of points, x and y of texts; a text's orientation; `points` and `colors` of
/// solids, texts and meshes; an arrow's `colors`; `color` where `colors` are given.
///
/// Refused: numbers that are not finite, absurdly far places; a number of points that makes no
/// primitives; a number of colors that is not that of the points (TRIANGLE_LIST: or of the
/// triangles); extents of 0 or below that leave nothing to see; meshes and texts that MarkerAssets
/// refuses. One extent of 0 draws a solid flat.
///
/// TEXT_VIEW_FACING: scale.z is the height of a capital (the message's definition; RViz draws it
/// smaller, because its font's cells are that high). MESH_RESOURCE: with
/// mesh_use_embedded_materials the file's flat colors, times the marker's color unless that is all
/// zero. `mesh`: what `assets` know of the marker's mesh; without it they are asked, which can take
/// as long as reading it.
Converted<render::Drawable> toDrawable(const visualization_msgs::Marker& marker,
                                       MarkerAssets& assets,
                                       const MeshLibrary::Mesh* mesh = nullptr);

}  // namespace afterglow::nodes
