#include "render/gl/gpu_lists.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <stdexcept>
#include <variant>

namespace afterglow::render {
namespace {

constexpr std::ptrdiff_t kMostSpare = 8;

/// About the mean of finite points: of some, evenly chosen.
Eigen::Vector3f middleOf(const PointList& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  for (std::size_t i = 0; i < points.size(); i += points.size() / 1000 + 1) {
    if (!points[i].allFinite()) continue;
    sum += points[i].cast<double>();
    ++count;
  }
  return (sum / std::max(count, 1.0)).cast<float>();
}

Rgba byteColor(const Rgba& color) { return color; }
Rgba byteColor(const Color& color) { return asBytes(color); }

}  // namespace

void GpuMemory::reserve(std::size_t bytes) {
  if (size >= bytes && size > 0) return;
  size = std::max<std::size_t>(bytes + bytes / 4, 16);
  buffer = Buffer::make();
  glNamedBufferStorage(buffer.id(), static_cast<GLsizeiptr>(size), nullptr, 0);
}

void* Upload::room(std::size_t bytes) {
  first_ = (used_ + 15) / 16 * 16;
  used_ = first_ + bytes;
  if (used_ > size_) {
    constexpr GLbitfield kAccess = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    size_ = std::max(2 * size_, std::max<std::size_t>(bytes, 1 << 16));
    first_ = 0;
    used_ = bytes;
    buffer_ = Buffer::make();  // copies from the old one are still done
    const auto size = static_cast<GLsizeiptr>(size_);
    glNamedBufferStorage(buffer_.id(), size, nullptr, kAccess);
    mapped_ = static_cast<char*>(glMapNamedBufferRange(buffer_.id(), 0, size, kAccess));
    if (mapped_ == nullptr) throw std::runtime_error("the GPU gives no memory to write to");
  }
  return mapped_ + first_;
}

void Upload::send(GpuMemory& to) {
  const std::size_t bytes = used_ - first_;
  to.reserve(bytes);
  glCopyNamedBufferSubData(buffer_.id(), to.buffer.id(), static_cast<GLintptr>(first_), 0,
                           static_cast<GLsizeiptr>(bytes));
}

void GpuLists::begin() {
  upload_.begin();
  for (auto& [key, list] : lists_) list.is_used = false;
}

void GpuLists::end() {
  for (auto it = lists_.begin(); it != lists_.end();) {
    if (it->second.is_used) {
      ++it;
      continue;
    }
    for (GpuMemory* memory : {&it->second.points, &it->second.colors}) {
      if (memory->size > 0) spare_.push_back(std::move(*memory));
    }
    it = lists_.erase(it);
  }
  if (std::ptrdiff_t(spare_.size()) > kMostSpare)
    spare_.erase(spare_.begin(), spare_.end() - kMostSpare);
}

GpuList& GpuLists::of(const Shape& shape) {
  const auto* cloud = std::get_if<PointCloud>(&shape);
  const auto* things = std::get_if<ShapeList>(&shape);
  const PointList& points = cloud != nullptr ? cloud->points.get() : things->points.get();
  const void* colors = cloud != nullptr ? static_cast<const void*>(&cloud->colors.get())
                                        : static_cast<const void*>(&things->colors.get());
  const auto [known, is_new] = lists_.try_emplace({&points, colors});
  GpuList& list = known->second;
  list.is_used = true;
  if (!is_new) return list;
  list.shape = shape;
  sendPoints(points, list);
  if (cloud != nullptr) {
    sendColors(cloud->colors.get(), list);
  } else {
    sendColors(things->colors.get(), list);
  }
  return list;
}

/// Spare memory that is large enough, or none yet.
GpuMemory GpuLists::memory(std::size_t bytes) {
  const auto found = std::find_if(spare_.begin(), spare_.end(), [&](const GpuMemory& memory) {
    return memory.size >= bytes && memory.size < 2 * bytes;
  });
  if (found == spare_.end()) return {};
  GpuMemory memory = std::move(*found);
  spare_.erase(found);
  return memory;
}

void GpuLists::sendPoints(const PointList& points, GpuList& list) {
  list.count = points.size();
  if (points.empty()) return;
  auto* to = static_cast<Eigen::Vector3f*>(upload_.room(points.size() * sizeof(points[0])));
  workers_.share(points.size(), [&](int, std::size_t begin, std::size_t end) {
    std::copy(points.begin() + static_cast<std::ptrdiff_t>(begin),
              points.begin() + static_cast<std::ptrdiff_t>(end), to + begin);
  });
  list.middle = middleOf(points);
  const auto first =
      std::find_if(points.begin(), points.end(), [](const auto& p) { return p.allFinite(); });
  if (first != points.end()) list.first = *first;
  list.points = memory(points.size() * sizeof(points[0]));
  upload_.send(list.points);
}

template <typename Colors>
void GpuLists::sendColors(const Colors& colors, GpuList& list) {
  list.has_colors = !colors.empty() && colors.size() >= list.count;
  if (!list.has_colors) return;
  auto* to = static_cast<Rgba*>(upload_.room(list.count * sizeof(Rgba)));
  std::array<bool, Workers::kMost> is_opaque;
  is_opaque.fill(true);
  workers_.share(list.count, [&](int worker, std::size_t begin, std::size_t end) {
    unsigned alpha = 255;
    for (std::size_t i = begin; i < end; ++i) {
      to[i] = byteColor(colors[i]);
      alpha &= byteColor(colors[i]).a;
    }
    is_opaque[static_cast<std::size_t>(worker)] = alpha == 255;
  });
  list.is_opaque = std::all_of(is_opaque.begin(), is_opaque.end(), [](bool is) { return is; });
  list.colors = memory(list.count * sizeof(Rgba));
  upload_.send(list.colors);
}

}  // namespace afterglow::render
