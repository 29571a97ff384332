/// \file
/// A scene made ready for a projector's lens: vertices in its optical frame, cut, split and in the
/// order in which they are drawn. GL-free, so that it can be tested without a context.
#pragma once

#include <cstdint>
#include <vector>

#include "render/scene/cut.hpp"
#include "render/scene/mesh.hpp"
#include "render/scene/scene.hpp"
#include "render/scene/tessellate.hpp"
#include "render/splat/point_projector.hpp"

namespace afterglow::render {

/// As it is uploaded.
struct LightVertex {
  float x, y, z;  ///< optical frame, metres
  float depth;    ///< -1 (drawn over) to 1; linear on the image
  Rgba color;
};
struct LightPoint {
  LightVertex center;
  float size_px;
};

struct LightStep {
  enum class Kind {
    Opaque,       ///< triangles
    Translucent,  ///< triangles of one drawable, of which each pixel takes the nearest only
    Points,       ///< blended by how much of each pixel they cover, farthest first
    Painted,      ///< the same, drawn by a PointPainter; nothing there hides them
  };
  Kind kind;
  std::uint32_t first, count;  ///< of `indices`, `points` or `runs`
};

struct LightLayer {
  /// Triangles whose even-odd union is the surface's outline; none: not clipped to one.
  std::uint32_t mask_first = 0, mask_count = 0;
  bool masked = false;
  /// Flattened layers hide by height over the surface and lie over what was drawn before; the
  /// others hide each other by distance.
  bool flattened = false;
  std::vector<LightStep> steps;
};

struct LightFrame {
  std::vector<LightVertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<LightPoint> points;
  std::vector<LightLayer> layers;
  std::vector<ScreenPoint> screen_points;  ///< those of `runs`, and after them room
  std::vector<PointRun> runs;

  /// Whether painted points are all there is, with no outline to cut them.
  bool isPaintedOnly() const;
};

/// Keeps its buffers from frame to frame.
class LightComposer {
 public:
  /// Points reach this far (px) over the image's border before they are dropped.
  static constexpr double kPointMargin = 128;

  explicit LightComposer(const calib::Lens& lens);
  LightComposer(const LightComposer&) = delete;
  LightComposer& operator=(const LightComposer&) = delete;

  /// With workers, which must outlive this, clouds of PointStyle::Points become Painted steps
  /// where nothing can hide them and, in a frame that OpenGL has to draw anyway, are large enough
  /// to be worth it. nullptr: all become Points steps.
  void paintPoints(Workers* workers) { workers_ = workers; }
  bool paintsPoints() const { return workers_ != nullptr; }

  /// Valid until the next call. Throws std::logic_error as placementMatrix does.
  const LightFrame& compose(const Scene& scene, const Rigid<Projector, World>& T_projector_world);

 private:
  /// A layer's way to the image.
  struct Placed {
    /// Placement, then the projector's pose.
    Eigen::Matrix4d P_optical_world = Eigen::Matrix4d::Identity();
    /// Height over the surface = height . p_world
    Eigen::Vector4d height = Eigen::Vector4d::Zero();
    bool flattened = false;
  };
  struct Sorted {
    LightStep step;
    double depth;
  };

  void addLayer(const Layer& layer, const Rigid<Projector, World>& T_projector_world);
  bool isPainted(const Layer& layer) const;
  void addPainted(const Drawable& drawable, const Placed& placed);
  void addMask(const SurfacePatch& surface, const Rigid<Projector, World>& T_projector_world,
               LightLayer& out);
  void addDrawable(const Placed& placed);
  void addSteps(LightLayer& out);
  void addMesh(const Mesh& mesh, const Placed& placed);
  void addSplats(const std::vector<Splat>& splats, const Placed& placed);
  LightVertex lightVertex(const CutVertex& vertex, const Placed& placed) const;
  std::uint32_t addVertex(const CutVertex& vertex, const Placed& placed);

  calib::Lens lens_;
  LensDomain domain_;
  TriangleCutter cutter_;
  LightFrame frame_;
  Tessellation tessellation_;
  std::vector<CutVertex> cut_vertices_;
  std::vector<char> inside_;
  std::vector<std::uint32_t> index_of_;
  std::vector<Sorted> steps_;

  PointProjector point_projector_;
  Workers* workers_ = nullptr;
  std::size_t screen_point_count_ = 0;
  bool has_more_than_points_ = false;  ///< this frame
  bool was_flattened_ = false;         ///< the layer before
  bool has_depths_ = false;            ///< triangles drawn before may hide what follows
};

}  // namespace afterglow::render
