/// \file
/// Lists of points in the GPU's own memory: a list is sent there once, and stays as long as images
/// show it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "render/compose/workers.hpp"
#include "render/gl/gl_handle.hpp"
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

}  // namespace afterglow::render
