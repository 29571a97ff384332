#include "render/gl/list_light.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include "render/compose/triangle_projector.hpp"
#include "render/gl/render_target.hpp"
#include "render/gl/shader.hpp"

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
  glFlush();  // they are on their way while the colors are written
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

namespace {

/// Shorter lists are less work among the triangles: each list is a call of its own.
constexpr std::size_t kLeastThings = 200;
/// Larger squares and boxes may bend in the lens; a larger ball's depth is not that of its outline.
constexpr float kLargestFlat = 64, kLargestBall = 24;  // px
constexpr float kFewSidesUpTo = 6;                     // px, of a ball
constexpr GLuint kTileGroup = 256;                     // of tile_points.comp
constexpr int kLeastTile = 16;                         // px, as paint_points.comp has it

Eigen::Vector4f shares(const Color& color, float alpha, float gain) {
  return Eigen::Vector4f(gain * color.r, gain * color.g, gain * color.b, alpha)
      .cwiseMax(0)
      .cwiseMin(1);
}

/// The chosen ones of a list's points, with their colors.
template <typename List>
List chosenOf(const List& list, const std::vector<std::size_t>& chosen) {
  List some = list;
  some.points = {};
  some.colors = {};
  for (const std::size_t i : chosen) {
    some.points.push_back(list.points[i]);
    if (i < list.colors.size()) some.colors.push_back(list.colors[i]);
  }
  return some;
}

}  // namespace

Program makeLightProgram(const std::vector<std::string>& vertex_files, const char* fragment_file,
                         const calib::Lens& lens) {
  Program program =
      makeProgram({{GL_VERTEX_SHADER, vertex_files}, {GL_FRAGMENT_SHADER, {fragment_file}}});
  setLens(program, lens);
  const Eigen::Vector2f size(lens.width, lens.height);
  setUniform(program, "viewport",
             Eigen::Vector4f(-kPointMargin, -kPointMargin, size.x() + 2 * kPointMargin,
                             size.y() + 2 * kPointMargin));
  return program;
}

ListPainter::ListPainter(const calib::Lens& lens, Workers& workers)
    : domain_(lens),
      is_bent_(lens.model == calib::LensModel::Equidistant ||
               std::any_of(lens.D.begin(), lens.D.end(), [](double d) { return d != 0; })),
      workers_(workers),
      lists_(workers),
      image_size_(lens.width, lens.height),
      thing_program_(
          makeLightProgram({"lens.glsl", "list.glsl", "thing.vert"}, "light.frag", lens)),
      tile_program_(makeProgram(
          {{GL_COMPUTE_SHADER, {"lens.glsl", "list.glsl", "tiles.glsl", "tile_points.comp"}}})),
      paint_program_(makeProgram({{GL_COMPUTE_SHADER, {"tiles.glsl", "paint_points.comp"}}})),
      lay_program_(makeProgram(
          {{GL_VERTEX_SHADER, {"screen.vert"}}, {GL_FRAGMENT_SHADER, {"points.frag"}}})) {
  setLens(tile_program_, lens);
}

std::optional<ListLight> ListPainter::lightOf(const Drawable& drawable,
                                              const ComposedLayer& layer) {
  const PointCloud* cloud = pixelCloud(drawable.shape);
  const auto things = cloud == nullptr ? spriteList(drawable.shape) : std::nullopt;
  const bool is_short = things && things->points->size() < kLeastThings;
  if ((cloud == nullptr && !things) || is_short || (things && layer.relief != nullptr)) {
    return std::nullopt;
  }
  ListLight light;
  near_.clear();
  light.list = &lists_.of(drawable.shape);
  const PointPlacement placement = pointPlacement(drawable, layer.placed);
  light.placement = placement.from(light.list->first);
  const float gain = layer.placed.gain;
  light.tint = Eigen::Vector4f(gain, gain, gain, std::max(drawable.color.a, 0.f));
  light.color = shares(drawable.color, drawable.color.a, gain);
  const bool is_opaque = asBytes(drawable.color).a == 255 && light.list->is_opaque;
  if (cloud != nullptr) {
    light.size_px = cloud->size;
  } else {
    light.is_opaque = is_opaque;
    light.shape = things->shape;
    light.shape.turnTo(layer.eye, drawable.pose.matrix());
    setSizes(*things->points, light);
  }
  const PointPlacement middle = placement.from(light.list->middle);
  const CutVertex vertex{middle.P_optical_cloud.col(3), Eigen::Vector4f::Zero(), middle.height[3]};
  const float depth = lightVertex(vertex, layer.placed).depth;
  light.mean_depth = std::isfinite(depth) ? static_cast<double>(depth) : 0;
  return light;
}

void ListPainter::setSizes(const PointList& points, ListLight& light) {
  SpriteShape& shape = light.shape;
  const bool is_ball = shape.kind == SpriteShape::Kind::Ball;
  if (shape.kind == SpriteShape::Kind::Square) shape.half.z() = 0;
  const float radius = is_ball ? shape.half.maxCoeff() : shape.half.norm();
  const Eigen::Matrix4f P = light.placement.P_optical_cloud.cast<float>();
  light.reach = radius * Eigen::Vector2f(P.topLeftCorner<3, 3>().colwise().norm().maxCoeff(),
                                         P.bottomLeftCorner<1, 3>().norm());
  const float size = 2 * light.reach.x() * static_cast<float>(domain_.focal().maxCoeff());
  light.nearest = light.reach.x() + 2 * static_cast<float>(LensDomain::kNear);
  if (is_ball || is_bent_) {
    light.nearest = std::max(light.nearest, size / (is_ball ? kLargestBall : kLargestFlat));
  }
  const float seen_from = findNear(points, P.row(2), light);
  const bool is_small = size <= kFewSidesUpTo * seen_from;
  light.vertices = is_ball ? (is_small ? 18 : 42) : shape.kind == SpriteShape::Kind::Box ? 18 : 6;
}

/// Returns how far the nearest of the others is.
float ListPainter::findNear(const PointList& points, const Eigen::RowVector4f& row,
                            const ListLight& light) {
  struct Part {
    float nearest = 1e9f;
    std::vector<std::size_t> near;
  };
  std::vector<Part> parts(static_cast<std::size_t>(workers_.sharers(points.size())));
  workers_.share(points.size(), [&](int worker, std::size_t begin, std::size_t end) {
    Part part;
    for (std::size_t i = begin; i < end; ++i) {
      const float z = row.head<3>().dot(points[i] - light.list->first) + row[3];
      if (z > -light.reach.x() && z < 1.0001f * light.nearest) part.near.push_back(i);
      if (z >= light.nearest && z < part.nearest) part.nearest = z;
    }
    parts[static_cast<std::size_t>(worker)] = std::move(part);
  });
  near_.clear();
  float nearest = 1e9f;
  for (const Part& part : parts) {
    near_.insert(near_.end(), part.near.begin(), part.near.end());
    nearest = std::min(nearest, part.nearest);
  }
  return nearest;
}

std::optional<Drawable> ListPainter::nearThings(const Drawable& drawable) const {
  if (near_.empty()) return std::nullopt;
  Drawable some = drawable;
  if (const auto* cloud = std::get_if<PointCloud>(&drawable.shape)) {
    some.shape = chosenOf(*cloud, near_);
  } else {
    some.shape = chosenOf(std::get<ShapeList>(drawable.shape), near_);
  }
  return some;
}

void ListPainter::bind(const Program& program, const ListLight& light) const {
  const PointPlacement& placement = light.placement;
  setUniform(program, "list_origin", light.list->first);
  setUniform(program, "P_optical_list", Eigen::Matrix4f(placement.P_optical_cloud.cast<float>()));
  setUniform(program, "list_height", Eigen::Vector4f(placement.height.cast<float>()));
  setUniform(program, "list_is_flattened", GLint{placement.flattened});
  setUniform(program, "list_has_colors", GLint{light.list->has_colors});
  setUniform(program, "list_tint", light.tint);
  setUniform(program, "list_color", light.color);
  glUseProgram(program.id());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, light.list->points.buffer.id());
  const Buffer& colors =
      light.list->has_colors ? light.list->colors.buffer : light.list->points.buffer;
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, colors.id());
}

/// The first list writes every pixel: to clear them takes a GPU as long as a third of the painting.
const Buffer& ListPainter::painted() {
  if (is_unpainted_) {
    const GLsizeiptr bytes = 4 * GLsizeiptr{image_size_.prod()};
    painted_.reserve(static_cast<std::size_t>(bytes));
    glClearNamedBufferSubData(painted_.buffer.id(), GL_R32UI, 0, bytes, GL_RED_INTEGER,
                              GL_UNSIGNED_INT, nullptr);
  }
  return painted_.buffer;
}

void ListPainter::drawPoints(const ListLight& light, const Texture* depths) {
  if (light.list->count == 0) return;
  paint(light, depths);
  if (depths == nullptr) return;
  setUniform(lay_program_, "image_size", image_size_);
  glUseProgram(lay_program_.id());
  glBindVertexArray(no_vertices_.id());
  glDisable(GL_DEPTH_TEST);
  glDepthMask(GL_FALSE);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

void ListPainter::paint(const ListLight& light, const Texture* depths) {
  int tile_px = kLeastTile;
  while (static_cast<float>(tile_px) < light.size_px) tile_px *= 2;
  const Eigen::Vector2i tiles = ((image_size_.array() + tile_px - 1) / tile_px).matrix();
  const auto tile_count = static_cast<GLuint>(tiles.prod());
  const auto count = static_cast<GLuint>(light.list->count);
  const int samples = depths != nullptr ? RenderTarget::kSamples : 1;
  constexpr std::size_t kSeenPoint = 16, kTile = 12, kItem = 8;  // bytes, as tiles.glsl has them
  const std::size_t tile_bytes = 4 + kTile * tile_count;
  seen_.reserve(kSeenPoint * count);
  tiles_.reserve(tile_bytes);
  items_.reserve(4 * kItem * count);
  painted_.reserve(4 * static_cast<std::size_t>(image_size_.prod() * samples));
  for (const Program* program : {&tile_program_, &paint_program_}) {
    setUniform(*program, "tile_count", tiles);
    setUniform(*program, "tile_px", tile_px);
    setUniform(*program, "size_px", light.size_px);
  }
  setUniform(tile_program_, "list_count", static_cast<GLint>(count));
  setUniform(paint_program_, "image_size", image_size_);
  setUniform(paint_program_, "sample_count", samples);
  setUniform(paint_program_, "is_first", GLint{is_unpainted_});
  is_unpainted_ = false;
  bind(tile_program_, light);
  const GpuMemory* memories[] = {&seen_, &tiles_, &items_, &painted_};
  for (GLuint i = 0; i < 4; ++i) {
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2 + i, memories[i]->buffer.id());
  }
  glClearNamedBufferSubData(tiles_.buffer.id(), GL_R32UI, 0, static_cast<GLsizeiptr>(tile_bytes),
                            GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
  for (GLint step = 0; step < 3; ++step) {
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    setUniform(tile_program_, "step_number", step);
    glDispatchCompute(((step == 1 ? tile_count : count) + kTileGroup - 1) / kTileGroup, 1, 1);
  }
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  if (depths != nullptr) glBindTextureUnit(0, depths->id());
  glUseProgram(paint_program_.id());
  glDispatchCompute(static_cast<GLuint>(tiles.x()), static_cast<GLuint>(tiles.y()), 1);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

void ListPainter::drawThings(const ListLight& light) {
  if (light.list->count == 0) return;
  bind(thing_program_, light);
  glBindVertexArray(no_vertices_.id());
  const SpriteShape& shape = light.shape;
  const Eigen::Vector3f eye =
      shape.eye_is_direction ? shape.eye : Eigen::Vector3f(shape.eye - light.list->first);
  setUniform(thing_program_, "thing_kind", static_cast<GLint>(shape.kind));
  setUniform(thing_program_, "thing_vertices", GLint{light.vertices});
  setUniform(thing_program_, "thing_half", shape.half);
  setUniform(thing_program_, "thing_right", shape.right);
  setUniform(thing_program_, "thing_up", shape.up);
  setUniform(thing_program_, "thing_eye",
             Eigen::Vector4f(eye.x(), eye.y(), eye.z(), shape.eye_is_direction ? 0 : 1));
  setUniform(thing_program_, "thing_reach", light.reach);
  setUniform(thing_program_, "thing_nearest", light.nearest);
  glDrawArrays(GL_TRIANGLES, 0, light.vertices * static_cast<GLsizei>(light.list->count));
}

}  // namespace afterglow::render
