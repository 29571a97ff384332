// Composed images drawn by OpenGL.
#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "render/compose/triangle_projector.hpp"
#include "render/gl/gl_context.hpp"
#include "render/gl/render_target.hpp"
#include "render/gl/shader.hpp"

namespace afterglow::render {
namespace {

constexpr GLuint kInOutline = 0x80;  ///< stencil bit: within the layer's surface
constexpr GLuint kInShade = 0x40;    ///< and behind another one
constexpr GLuint kDrawnBits = 0x3f;  ///< stencil bits: the last translucent thing drawn here

struct LightPoint {
  LightVertex center;
  float size_px;
};

/// Any order of drawing shows the same if all have one opaque color.
bool needsSorting(const std::vector<LightPoint>& points, std::size_t first) {
  const Rgba color = points[first].center.color;
  return !isOpaque(color) ||
         std::any_of(points.begin() + static_cast<std::ptrdiff_t>(first), points.end(),
                     [&](const LightPoint& point) { return point.center.color != color; });
}

/// Expands each step for OpenGL: pixel-sized clouds become points, all else triangles.
class GlExpander {
 public:
  explicit GlExpander(const calib::Lens& lens) : lens_(lens), triangle_projector_(lens) {}

  void expand(const ComposedImage& composed) {
    triangles_.begin(composed);
    points_.clear();
    layers_.clear();
    for (const ComposedLayer& layer : composed.layers) {
      ExpandedLayer out{layer.mask, layer.placed.flattened, {}};
      for (const Drawable* drawable : layer.steps) {
        const bool is_points = pixelCloud(drawable->shape) != nullptr;
        const auto piece = is_points ? addPoints(*drawable, layer.placed)
                                     : addTriangles(*drawable, layer);
        if (piece) out.pieces.push_back(*piece);
      }
      sortForDrawing(out.pieces);
      layers_.push_back(std::move(out));
    }
  }

  const LightTriangles& triangles() const { return triangles_; }
  const std::vector<LightPoint>& points() const { return points_; }
  const std::vector<ExpandedLayer>& layers() const { return layers_; }

 private:
  std::optional<Piece> addTriangles(const Drawable& drawable, const ComposedLayer& layer) {
    triangle_projector_.place(drawable, layer);
    return triangle_projector_.add(triangles_);
  }

  std::optional<Piece> addPoints(const Drawable& drawable, const Placed& placed) {
    const std::size_t first = points_.size();
    tessellate(drawable, {}, tessellation_);
    for (const Splat& splat : tessellation_.splats) addPoint(splat, placed);
    const std::size_t count = points_.size() - first;
    if (count == 0) return std::nullopt;
    const auto begin = points_.begin() + static_cast<std::ptrdiff_t>(first);
    if (needsSorting(points_, first)) {
      std::stable_sort(begin, points_.end(), [](const LightPoint& a, const LightPoint& b) {
        return a.center.depth > b.center.depth;
      });
    }
    double depth = 0;
    for (auto it = begin; it != points_.end(); ++it) depth += static_cast<double>(it->center.depth);
    return Piece{Piece::Kind::Points, false, static_cast<std::uint32_t>(first),
                 static_cast<std::uint32_t>(count), depth / static_cast<double>(count)};
  }

  void addPoint(const Splat& splat, const Placed& placed) {
    if (isInvisible(splat.color)) return;
    const Eigen::Vector4d p_world = splat.p_world.homogeneous();
    CutVertex vertex{placed.P_optical_world * p_world, asFloats(splat.color, placed.gain),
                     placed.height.dot(p_world)};
    if (!(vertex.p_optical.w() > 0)) return;
    vertex.p_optical /= vertex.p_optical.w();
    if (!(vertex.p_optical.z() >= LensDomain::kNear)) return;
    const auto pixel = calib::project(lens_, vertex.p_optical.head<3>());
    constexpr auto kMargin = double{kPointMargin};
    if (!pixel || (pixel->array() < -kMargin).any() || pixel->x() > lens_.width + kMargin ||
        pixel->y() > lens_.height + kMargin) {
      return;
    }
    points_.push_back({lightVertex(vertex, placed), splat.size_px});
  }

  calib::Lens lens_;
  TriangleProjector triangle_projector_;
  Tessellation tessellation_;
  LightTriangles triangles_;
  std::vector<LightPoint> points_;
  std::vector<ExpandedLayer> layers_;
};

Program makeLightProgram(const char* fragment_file, const calib::Lens& lens) {
  Program program = makeProgram(
      {{GL_VERTEX_SHADER, {"lens.glsl", "light.vert"}}, {GL_FRAGMENT_SHADER, {fragment_file}}});
  setLens(program, lens);
  const glm::vec2 size(lens.width, lens.height), margin(kPointMargin);
  setUniform(program, "viewport", glm::vec4(-margin, size + 2.f * margin));
  return program;
}

/// LightVertex; LightPoint begins with one.
template <typename Vertex>
VertexArray makeLightArray(const Buffer& vertices) {
  VertexArray array = makeVertexArray<Vertex>(vertices);
  setAttribute<glm::vec3>(array, 0, offsetof(LightVertex, x));
  setAttribute<float>(array, 1, offsetof(LightVertex, depth));
  setAttribute<glm::u8vec4>(array, 2, offsetof(LightVertex, color));
  return array;
}

/// The OpenGL objects of one projector. Made, used and destroyed with their context current.
class GlScreen {
 public:
  explicit GlScreen(const calib::Lens& lens)
      : target_(lens.width, lens.height),
        triangle_program_(makeLightProgram("light.frag", lens)),
        point_program_(makeLightProgram("point.frag", lens)) {
    glVertexArrayElementBuffer(triangle_array_.id(), index_buffer_.id());
    setAttribute<float>(point_array_, 3, offsetof(LightPoint, size_px));
  }

  void draw(const GlExpander& expanded) {
    begin(expanded);
    bool was_flattened = false;
    for (const ExpandedLayer& layer : expanded.layers()) {
      if (layer.flattened || was_flattened) {
        glDepthMask(GL_TRUE);
        glClear(GL_DEPTH_BUFFER_BIT);
      }
      was_flattened = layer.flattened;
      if (layer.mask >= 0) {
        drawMask(expanded.triangles().masks[static_cast<std::size_t>(layer.mask)]);
      }
      for (const Piece& piece : layer.pieces) draw(piece, layer.mask >= 0);
    }
    target_.beginReading();
  }
  void read(Image& image) { target_.read(image); }

 private:
  void begin(const GlExpander& expanded) {
    upload(vertex_buffer_, expanded.triangles().vertices);
    upload(index_buffer_, expanded.triangles().indices);
    upload(point_buffer_, expanded.points());
    target_.begin(glm::vec3(0));
    const auto margin = static_cast<int>(kPointMargin);
    glViewport(-margin, -margin, target_.width() + 2 * margin, target_.height() + 2 * margin);
    glEnable(GL_PROGRAM_POINT_SIZE);
    glEnable(GL_MULTISAMPLE);
    glEnable(GL_STENCIL_TEST);
    glDisable(GL_CULL_FACE);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    translucent_id_ = 0;
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

  void draw(const Piece& piece, bool is_masked) {
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    glStencilMask(0);
    glStencilFunc(is_masked ? GL_EQUAL : GL_ALWAYS, kInOutline, kInOutline);
    if (piece.kind == Piece::Kind::Points) {
      glEnable(GL_BLEND);
      glDepthMask(GL_FALSE);
      glUseProgram(point_program_.id());
      glBindVertexArray(point_array_.id());
      glDrawArrays(GL_POINTS, static_cast<GLint>(piece.first), static_cast<GLsizei>(piece.count));
    } else if (piece.is_opaque) {
      glDisable(GL_BLEND);
      glDepthMask(GL_TRUE);
      drawTriangles(piece.first, piece.count);
    } else {
      drawTranslucent(piece);
    }
  }

  /// First where its nearest surface is, then that surface's light, once a sample: where faces
  /// overlap, they do not add up.
  void drawTranslucent(const Piece& piece) {
    glDisable(GL_BLEND);
    glDepthMask(GL_TRUE);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    drawTriangles(piece.first, piece.count);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glEnable(GL_BLEND);
    glDepthMask(GL_FALSE);
    glDepthFunc(GL_EQUAL);  // nothing but the pass before has left these depths, so no outline test
    glStencilMask(kDrawnBits);
    if (++translucent_id_ > kDrawnBits) {
      glClear(GL_STENCIL_BUFFER_BIT);
      translucent_id_ = 1;
    }
    glStencilFunc(GL_NOTEQUAL, static_cast<GLint>(translucent_id_), kDrawnBits);
    glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    drawTriangles(piece.first, piece.count);
  }

  void drawTriangles(std::uint32_t first, std::uint32_t count) {
    glUseProgram(triangle_program_.id());
    glBindVertexArray(triangle_array_.id());
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(count), GL_UNSIGNED_INT,
                   reinterpret_cast<const void*>(first * sizeof(std::uint32_t)));
  }

  RenderTarget target_;
  Program triangle_program_, point_program_;
  Buffer vertex_buffer_ = Buffer::make(), index_buffer_ = Buffer::make(),
         point_buffer_ = Buffer::make();
  VertexArray triangle_array_ = makeLightArray<LightVertex>(vertex_buffer_);
  VertexArray point_array_ = makeLightArray<LightPoint>(point_buffer_);
  GLuint translucent_id_ = 0;
};

class GlDrawer final : public ImageDrawer {
 public:
  GlDrawer(GlContext& context, const calib::Lens& lens) : context_(context), expander_(lens) {
    context_.makeCurrent();
    screen_.emplace(lens);
  }
  ~GlDrawer() override { context_.makeCurrent(); }

  void begin(const ComposedImage& composed) override {
    expander_.expand(composed);
    context_.makeCurrent();
    screen_->draw(expander_);
  }
  void finish(Image& image) override {
    context_.makeCurrent();
    screen_->read(image);
  }

 private:
  GlContext& context_;
  GlExpander expander_;
  std::optional<GlScreen> screen_;
};

}  // namespace

std::unique_ptr<ImageDrawer> makeGlDrawer(GlContext& context, const calib::Lens& lens) {
  return std::make_unique<GlDrawer>(context, lens);
}

}  // namespace afterglow::render
