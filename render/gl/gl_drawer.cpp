// Composed images drawn by OpenGL.
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "render/compose/triangle_projector.hpp"
#include "render/gl/gl_context.hpp"
#include "render/gl/list_light.hpp"
#include "render/gl/render_target.hpp"
#include "render/gl/shader.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {
namespace {

constexpr GLuint kInOutline = 0x80;  ///< stencil bit: within the layer's surface
constexpr GLuint kInShade = 0x40;    ///< and behind another one
constexpr GLuint kDrawnBits = 0x3f;  ///< stencil bits: the last translucent thing drawn here

/// Triangles in the GPU's memory.
struct GpuTriangles {
  GpuMemory vertices, indices;
};

/// A part of a layer's triangles, expanded by one worker.
struct TrianglePart {
  LightTriangles triangles;
  std::vector<Piece> pieces;
};

/// The light of a layer; kept for the next image, where it may be the same.
struct LayerLight {
  ComposedLayer layer;  ///< layer without steps
  std::vector<Drawable> steps;
  GpuTriangles triangles;
  std::vector<ListLight> lists;
  std::vector<Piece> pieces;  ///< pieces of triangles' indices; Outlines and Points: of lists

  bool isOf(const ComposedLayer& other) const {
    return isSamePlace(layer, other) &&
           std::equal(steps.begin(), steps.end(), other.steps.begin(), other.steps.end(),
                      [](const Drawable& a, const Drawable* b) { return isSame(a, *b); });
  }
};

/// Expands what is no list to triangles, by all workers.
class TriangleExpander {
 public:
  TriangleExpander(const calib::Lens& lens, Workers& workers) : workers_(workers) {
    for (int i = 0; i < workers.count(); ++i) projectors_.emplace_back(lens);
  }

  /// Sends the steps' triangles and appends their pieces.
  void expand(const std::vector<const Drawable*>& steps, const ComposedLayer& layer, Upload& upload,
              GpuTriangles& out, std::vector<Piece>& pieces) {
    constexpr std::size_t kLeastPart = 16, kPartsEach = 4;
    const std::size_t most = kPartsEach * projectors_.size();
    const std::size_t count = std::clamp<std::size_t>(steps.size() / kLeastPart, 1, most);
    if (parts_.size() < count) parts_.resize(count);
    forEachPart(count, [&](TriangleProjector& projector, std::size_t part) {
      parts_[part].triangles.begin({});
      parts_[part].pieces.clear();
      const std::size_t end = steps.size() * (part + 1) / count;
      for (std::size_t i = steps.size() * part / count; i < end; ++i) {
        projector.place(*steps[i], layer);
        const auto piece = projector.add(parts_[part].triangles);
        if (piece) parts_[part].pieces.push_back(*piece);
      }
    });
    send(count, upload, out, pieces);
  }

  /// Sends triangles that are expanded already.
  static void send(const LightTriangles& triangles, Upload& upload, GpuTriangles& out) {
    const auto copy = [&](const auto& values, GpuMemory& to) {
      const std::size_t bytes = values.size() * sizeof(values[0]);
      if (bytes == 0) return;
      std::memcpy(upload.room(bytes), values.data(), bytes);
      upload.send(to);
    };
    copy(triangles.vertices, out.vertices);
    copy(triangles.indices, out.indices);
  }

 private:
  template <typename Work>
  void forEachPart(std::size_t count, const Work& work) {
    if (count == 1) return work(projectors_.front(), std::size_t{0});
    std::atomic<std::size_t> next{0};
    workers_.run([&](int worker) {
      for (std::size_t part = next++; part < count; part = next++) {
        work(projectors_[static_cast<std::size_t>(worker)], part);
      }
    });
  }

  /// The parts one after the other.
  void send(std::size_t count, Upload& upload, GpuTriangles& out, std::vector<Piece>& pieces) {
    std::vector<std::uint32_t> first_vertex{0}, first_index{0};
    for (std::size_t i = 0; i < count; ++i) {
      const LightTriangles& part = parts_[i].triangles;
      for (Piece piece : parts_[i].pieces) {
        piece.first += first_index[i];
        pieces.push_back(piece);
      }
      first_vertex.push_back(first_vertex[i] + static_cast<std::uint32_t>(part.vertices.size()));
      first_index.push_back(first_index[i] + static_cast<std::uint32_t>(part.indices.size()));
    }
    if (first_index[count] == 0) return;
    auto* vertices =
        static_cast<LightVertex*>(upload.room(first_vertex[count] * sizeof(LightVertex)));
    forEachPart(count, [&](TriangleProjector&, std::size_t part) {
      const auto& own = parts_[part].triangles.vertices;
      std::copy(own.begin(), own.end(), vertices + first_vertex[part]);
    });
    upload.send(out.vertices);
    auto* indices =
        static_cast<std::uint32_t*>(upload.room(first_index[count] * sizeof(std::uint32_t)));
    forEachPart(count, [&](TriangleProjector&, std::size_t part) {
      const auto& own = parts_[part].triangles.indices;
      std::transform(own.begin(), own.end(), indices + first_index[part],
                     [&](std::uint32_t index) { return index + first_vertex[part]; });
    });
    upload.send(out.indices);
  }

  Workers& workers_;
  std::deque<TriangleProjector> projectors_;  ///< a projector for each worker
  std::vector<TrianglePart> parts_;
};

/// The OpenGL objects of one projector, and how its light is drawn with them. Made, used and
/// destroyed with their context current.
class GlScreen {
 public:
  GlScreen(const calib::Lens& lens, Workers& workers)
      : lists_(lens, workers),
        target_(lens.width, lens.height),
        triangle_program_(makeLightProgram({"lens.glsl", "light.vert"}, "light.frag", lens)) {
    setAttribute<glm::vec3>(triangle_array_, 0, offsetof(LightVertex, x));
    setAttribute<float>(triangle_array_, 1, offsetof(LightVertex, depth));
    setAttribute<glm::u8vec4>(triangle_array_, 2, offsetof(LightVertex, color));
  }

  /// `is_painted`: points are all there is to come, without masks.
  void begin(bool is_painted) {
    is_painted_ = is_painted;
    if (is_painted) return lists_.beginPainting();
    target_.begin();
    const auto margin = static_cast<int>(kPointMargin);
    glViewport(-margin, -margin, target_.width() + 2 * margin, target_.height() + 2 * margin);
    glEnable(GL_MULTISAMPLE);
    glEnable(GL_STENCIL_TEST);
    glDisable(GL_CULL_FACE);
    translucent_id_ = 0;
    was_flattened_ = false;
  }

  /// `mask`: nullptr: light may go anywhere.
  void draw(const LayerLight& light, const LightMask* mask, const GpuTriangles& masks) {
    if (is_painted_) {
      for (const Piece& piece : light.pieces) lists_.drawPoints(light.lists[piece.first], nullptr);
      return;
    }
    const bool is_flattened = light.layer.placed.flattened;
    if (is_flattened || was_flattened_) {
      glDepthMask(GL_TRUE);
      glClear(GL_DEPTH_BUFFER_BIT);
    }
    was_flattened_ = is_flattened;
    if (mask != nullptr) {
      use(masks);
      drawMask(*mask);
    }
    for (const Piece& piece : light.pieces) draw(light, piece, mask != nullptr);
  }
  void finish() { target_.beginReading(is_painted_ ? &lists_.painted() : nullptr); }
  void read(Image& image, Workers& workers) { target_.read(image, workers); }
  ListPainter& lists() { return lists_; }

 private:
  void use(const GpuTriangles& triangles) {
    glVertexArrayVertexBuffer(triangle_array_.id(), 0, triangles.vertices.buffer.id(), 0,
                              sizeof(LightVertex));
    glVertexArrayElementBuffer(triangle_array_.id(), triangles.indices.buffer.id());
  }

  void drawMask(const LightMask& mask) {
    glStencilMask(kInOutline | kInShade);
    glClearStencil(mask.outline ? 0 : kInOutline);
    glClear(GL_STENCIL_BUFFER_BIT);
    glClearStencil(0);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    glDisable(GL_DEPTH_TEST);
    if (mask.outline) invert(kInOutline, *mask.outline);
    for (const LightOutline& shade : mask.shades) {
      invert(kInShade, shade);
      glStencilMask(kInOutline | kInShade);
      glStencilFunc(GL_EQUAL, kInShade, kInShade);
      glStencilOp(GL_KEEP, GL_KEEP, GL_ZERO);
      drawTriangles(shade.first, shade.count);
    }
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  }

  void invert(GLuint bit, const LightOutline& outline) {
    glStencilMask(bit);
    glStencilFunc(GL_ALWAYS, 0, 0);
    glStencilOp(GL_KEEP, GL_KEEP, GL_INVERT);
    drawTriangles(outline.first, outline.count);
  }

  void draw(const LayerLight& light, const Piece& piece, bool is_masked) {
    glStencilMask(0);
    glStencilFunc(is_masked ? GL_EQUAL : GL_ALWAYS, kInOutline, kInOutline);
    if (piece.kind == Piece::Kind::Points) {
      return lists_.drawPoints(light.lists[piece.first], &target_.depths());
    }
    use(light.triangles);
    const auto shapes = [&] {
      if (piece.kind == Piece::Kind::Triangles) return drawTriangles(piece.first, piece.count);
      for (std::uint32_t i = 0; i < piece.count; ++i) {
        lists_.drawThings(light.lists[piece.first + i]);
      }
    };
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
    if (!piece.is_opaque) return drawTranslucent(shapes);
    shapes();
  }

  /// First where its nearest surface is, then that surface's light, once a sample: where faces
  /// overlap, they do not add up.
  template <typename Shapes>
  void drawTranslucent(const Shapes& shapes) {
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    shapes();
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    glDepthMask(GL_FALSE);
    glDepthFunc(GL_EQUAL);  // nothing but the pass before has left these depths, so no outline test
    glStencilMask(kDrawnBits);
    if (++translucent_id_ > kDrawnBits) {
      glClear(GL_STENCIL_BUFFER_BIT);
      translucent_id_ = 1;
    }
    glStencilFunc(GL_NOTEQUAL, static_cast<GLint>(translucent_id_), kDrawnBits);
    glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    shapes();
  }

  void drawTriangles(std::uint32_t first, std::uint32_t count) {
    glUseProgram(triangle_program_.id());
    glBindVertexArray(triangle_array_.id());
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(count), GL_UNSIGNED_INT,
                   reinterpret_cast<const void*>(first * sizeof(std::uint32_t)));
  }

  ListPainter lists_;
  RenderTarget target_;
  Program triangle_program_;
  VertexArray triangle_array_ = VertexArray::make();
  GLuint translucent_id_ = 0;
  bool was_flattened_ = false, is_painted_ = false;
};

class GlDrawer final : public ImageDrawer {
 public:
  GlDrawer(GlContext& context, const calib::Lens& lens)
      : context_(context), triangles_(lens, workers_) {
    context_.makeCurrent();
    screen_.emplace(lens, workers_);
  }
  ~GlDrawer() override { context_.makeCurrent(); }

  void begin(const ComposedImage& composed) override {
    context_.makeCurrent();
    if (is_begun_) glFinish();  // it may not have copied all that was sent for that image
    is_begun_ = true;
    GpuLists& lists = screen_->lists().lists();
    lists.begin();
    screen_->begin(isOfPoints(composed));
    masks_.begin(composed);
    TriangleExpander::send(masks_, lists.upload(), gpu_masks_);
    glFlush();  // a GPU clears many samples as long as the CPU needs for its triangles
    layers_.resize(composed.layers.size());
    for (std::size_t i = 0; i < layers_.size(); ++i) expand(composed.layers[i], layers_[i]);
    lists.end();
    for (const LayerLight& light : layers_) {
      const int mask = light.layer.mask;
      screen_->draw(light, mask < 0 ? nullptr : &masks_.masks[static_cast<std::size_t>(mask)],
                    gpu_masks_);
    }
    screen_->finish();
  }
  void finish(Image& image) override {
    context_.makeCurrent();
    screen_->read(image, workers_);
    is_begun_ = false;
  }

 private:
  /// Returns true if it is points alone, without masks.
  static bool isOfPoints(const ComposedImage& composed) {
    const auto isPoints = [](const Drawable* step) { return pixelCloud(step->shape) != nullptr; };
    return composed.masks.empty() &&
           std::all_of(composed.layers.begin(), composed.layers.end(), [&](const auto& layer) {
             return std::all_of(layer.steps.begin(), layer.steps.end(), isPoints);
           });
  }

  void expand(const ComposedLayer& layer, LayerLight& light) {
    if (light.isOf(layer)) {
      for (ListLight& list : light.lists) list.list->is_used = true;
      return;
    }
    light.layer = layer;
    light.layer.steps.clear();
    light.steps.clear();
    light.lists.clear();
    light.pieces.clear();
    std::vector<const Drawable*> others;
    std::deque<Drawable> near;
    for (const Drawable* drawable : layer.steps) {
      light.steps.push_back(*drawable);
      const auto list = screen_->lists().lightOf(*drawable, layer);
      if (!list) {
        others.push_back(drawable);
        continue;
      }
      const auto kind = list->vertices == 0 ? Piece::Kind::Points : Piece::Kind::Outlines;
      light.pieces.push_back({kind, list->is_opaque, static_cast<std::uint32_t>(light.lists.size()),
                              1, list->mean_depth});
      light.lists.push_back(*list);
      if (auto some = screen_->lists().nearThings(*drawable)) {
        near.push_back(std::move(*some));
        others.push_back(&near.back());
      }
    }
    triangles_.expand(others, layer, screen_->lists().lists().upload(), light.triangles,
                      light.pieces);
    sortForDrawing(light.pieces);
  }

  GlContext& context_;
  Workers workers_;
  TriangleExpander triangles_;
  std::optional<GlScreen> screen_;
  LightTriangles masks_;
  GpuTriangles gpu_masks_;
  std::vector<LayerLight> layers_;
  bool is_begun_ = false;
};

}  // namespace

std::unique_ptr<ImageDrawer> makeGlDrawer(GlContext& context, const calib::Lens& lens) {
  return std::make_unique<GlDrawer>(context, lens);
}

}  // namespace afterglow::render
