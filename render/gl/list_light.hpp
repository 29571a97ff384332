/// \file
/// Clouds and lists of things alike as the GPU draws them: it places, colors and shapes them.
/// Points of so many pixels are painted tile by tile, in the order of their depth.
///
/// Lists of points in the GPU's own memory: a list is sent there once, and stays as long as images
/// show it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/lens.hpp"
#include "render/compose/composed_image.hpp"
#include "render/compose/thing_list.hpp"
#include "render/compose/workers.hpp"
#include "render/gl/gl_handle.hpp"
#include "render/scene/lens_domain.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// Memory that the GPU alone reads and writes.
struct GpuMemory {
  Buffer buffer;
  std::size_t size = 0;

  /// Room for so many bytes; what it held may be lost.
  void reserve(std::size_t bytes);
};

/// Memory that the CPU writes, and the GPU copies from.
class Upload {
 public:
  /// The GPU has copied all that was sent: its room is used again.
  void begin() { used_ = 0; }
  /// Room for so many bytes, to be written before the next call.
  void* room(std::size_t bytes);
  /// Sends what was written into the last room.
  void send(GpuMemory& to);

 private:
  Buffer buffer_;
  char* mapped_ = nullptr;
  std::size_t size_ = 0, used_ = 0, first_ = 0;
};

/// The points and colors of a cloud or list.
struct GpuList {
  Shape shape;  ///< the shape of these lists; as long as it is kept no others take their place
  GpuMemory points, colors;
  std::size_t count = 0;
  /// True: a color for each point.
  bool has_colors = false;
  bool is_opaque = true;  ///< true: its colors are opaque
  /// The first finite point; the mean of all.
  Eigen::Vector3f first = Eigen::Vector3f::Zero(), middle = first;
  bool is_used = true;  ///< true: the image that was begun last uses it
};

class GpuLists {
 public:
  explicit GpuLists(Workers& workers) : workers_(workers) {}

  /// Begins an image: what it uses is what it asks for from now on.
  void begin();
  /// The list of a PointCloud or ShapeList, where it is in the GPU's memory. Stays until end()
  /// finds that an image has not used it.
  GpuList& of(const Shape& shape);
  void end();
  /// The upload for the rest of an image.
  Upload& upload() { return upload_; }

 private:
  GpuMemory memory(std::size_t bytes);
  void sendPoints(const PointList& points, GpuList& list);
  template <typename Colors>
  void sendColors(const Colors& colors, GpuList& list);

  Workers& workers_;
  Upload upload_;
  /// The lists, by points and colors.
  std::map<std::pair<const void*, const void*>, GpuList> lists_;
  std::vector<GpuMemory> spare_;
};

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
  void beginPainting() { is_unpainted_ = true; }
  /// Draws points over painted(), or, with `depths`, over what is drawn and where that is not
  /// before them. Then it needs a viewport that covers the image, and changes how things are
  /// blended.
  void drawPoints(const ListLight& light, const Texture* depths);
  const Buffer& painted();

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
  bool is_unpainted_ = true;
  std::vector<std::size_t> near_;  ///< the near ones of the last light's things
  VertexArray no_vertices_ = VertexArray::make();
};

/// A program whose vertex shader puts light through the lens onto the image, which is `viewport`
/// without kPointMargin all around.
Program makeLightProgram(const std::vector<std::string>& vertex_files, const char* fragment_file,
                         const calib::Lens& lens);

}  // namespace afterglow::render
