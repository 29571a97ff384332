/// \file
/// Clouds and lists of things alike as the GPU draws them: it places, colors and shapes them.
/// Points of so many pixels are painted tile by tile, in the order of their depth.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/lens.hpp"
#include "render/compose/composed_image.hpp"
#include "render/compose/thing_list.hpp"
#include "render/gl/gpu_lists.hpp"
#include "render/scene/lens_domain.hpp"

namespace afterglow::render {

/// A list on its way to the image: what the shaders of list.glsl are told.
struct ListLight {
  GpuList* list = nullptr;
  PointPlacement placement;  ///< the placement of differences to the list's first point
  Eigen::Vector4f tint, color;
  bool is_opaque = false;
  float size_px = 0;                                ///< size of points
  SpriteShape shape{};                              ///< shape of things
  int vertices = 0;                                 ///< vertices of each thing; 0: points
  Eigen::Vector2f reach = Eigen::Vector2f::Zero();  ///< distance of corners from the center
  float nearest = 0;  ///< nearer things may bend in the lens, or touch its near plane
  double mean_depth = 0;
};

/// Makes lists into lights and draws them. Made, used and destroyed with its context current.
class ListPainter {
 public:
  ListPainter(const calib::Lens& lens, Workers& workers);

  GpuLists& lists() { return lists_; }
  /// The light of a cloud or list; absent: the shape is another one, or it is better drawn as
  /// triangles, being short or on a relief. Sends it to the GPU where it is not yet.
  std::optional<ListLight> lightOf(const Drawable& drawable, const ComposedLayer& layer);
  /// The things of the drawable's light, made last, that draw() leaves out as they are too near.
  std::optional<Drawable> nearThings(const Drawable& drawable) const;
  void drawThings(const ListLight& light);
  /// Begins an image of points alone: painted() is black.
  void beginPainting();
  /// Draws points over painted(), or, with `depths`, over what is drawn and where that is not
  /// before them. Then it needs a viewport that covers the image, and changes how things are
  /// blended.
  void drawPoints(const ListLight& light, const Texture* depths);
  const Buffer& painted() const { return painted_.buffer; }

 private:
  void setSizes(const PointList& points, ListLight& light);
  float findNear(const PointList& points, const Eigen::RowVector4f& row, const ListLight& light);
  void bind(const Program& program, const ListLight& light) const;
  void paint(const ListLight& light, const Texture* depths);

  LensDomain domain_;
  bool is_bent_;  ///< the lens bends straight lines
  Workers& workers_;
  GpuLists lists_;
  Eigen::Vector2i image_size_;
  Program thing_program_, tile_program_, paint_program_, lay_program_;
  GpuMemory seen_, tiles_, items_, painted_;
  std::vector<std::size_t> near_;  ///< the near ones of the last light's things
  VertexArray no_vertices_ = VertexArray::make();
};

/// A program whose vertex shader puts light through the lens onto the image, which is `viewport`
/// without kPointMargin all around.
Program makeLightProgram(const std::vector<std::string>& vertex_files, const char* fragment_file,
                         const calib::Lens& lens);

}  // namespace afterglow::render
