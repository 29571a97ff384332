/// \file
/// A scene made ready for a projector's lens: vertices in its optical frame, cut, split and in the
/// order in which they are drawn. GL-free, so that it can be tested without a context.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "render/paint/point_projector.hpp"
#include "render/paint/sprites.hpp"
#include "render/scene/cut.hpp"
#include "render/scene/mesh.hpp"
#include "render/scene/relief_placer.hpp"
#include "render/scene/scene.hpp"
#include "render/scene/tessellate.hpp"

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
    Run,          ///< the same, projected already, for a FramePainter
    Sprites,      ///< small things, projected already, for a FramePainter
  };
  Kind kind;
  std::uint32_t first, count;  ///< of `indices`, `points`, `runs` or `sprite_runs`
};

/// Triangles, in `indices`, whose even-odd union is an outline.
struct LightOutline {
  std::uint32_t first = 0, count = 0;
};
/// Where a surface catches light.
struct LightMask {
  std::optional<LightOutline> outline;  ///< none: it is endless
  std::vector<LightOutline> shades;     ///< surfaces before it
};

struct LightLayer {
  int mask = -1;  ///< of `masks`; -1: light may go anywhere
  /// Flattened layers hide by height over the surface and lie over what was drawn before; the
  /// others hide each other by distance.
  bool flattened = false;
  std::vector<LightStep> steps;
};

struct LightFrame {
  std::vector<LightVertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<LightPoint> points;
  std::vector<LightMask> masks;
  std::vector<LightLayer> layers;
  std::vector<ScreenPoint> screen_points;  ///< those of `runs`, and after them room
  std::vector<PointRun> runs;
  Sprites sprites;
  std::vector<SpriteRun> sprite_runs;
};

/// Keeps its buffers from frame to frame.
class LightComposer {
 public:
  /// Points reach this far (px) over the image's border before they are dropped.
  static constexpr double kPointMargin = double{PointProjector::kMargin};

  explicit LightComposer(const calib::Lens& lens);
  LightComposer(const LightComposer&) = delete;
  LightComposer& operator=(const LightComposer&) = delete;

  /// With workers, which must outlive this, for a FramePainter: clouds of PointStyle::Points become
  /// Run steps, lists of small things Sprites. nullptr: for OpenGL.
  void composeForPainter(Workers* workers) { workers_ = workers; }
  bool isForPainter() const { return workers_ != nullptr; }

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
    float gain = 1;  ///< of sRGB components
  };
  struct Sorted {
    LightStep step;
    double depth;
  };

  void addLayer(const Layer& layer, const Scene& scene,
                const Rigid<Projector, World>& T_projector_world);
  Drawable laid(const Drawable& drawable, const PointCloud& cloud) const;
  /// PointStyle::Points.
  void addPoints(const Drawable& drawable, const Placed& placed);
  void addRun(const Drawable& drawable, const Placed& placed);
  static PointPlacement pointPlacement(const Drawable& drawable, const Placed& placed);
  /// Whether the drawable is a list of things small enough; then it is added.
  bool addSprites(const Drawable& drawable, const Eye& eye, const Placed& placed);
  /// The tessellation's points, and its triangles.
  void addSplats(const Placed& placed);
  void addMesh(const Placed& placed);
  void addThin(const ThinLine& line, const Placed& placed);
  void addTriangles(const Mesh& mesh, const Placed& placed);
  void findOutlinePoints(const Placed& placed);
  void addFlat(const Placed& placed);
  void addHulls(const Placed& placed);
  void addSpriteRun(const SpriteRun& run);
  /// The surface's mask, made once a frame; -1: it needs none.
  int maskOf(const SurfacePatch& surface, const Scene& scene,
             const Rigid<Projector, World>& T_projector_world);
  LightOutline addOutline(const std::vector<Eigen::Vector3d>& corners_world,
                          const Rigid<Projector, World>& T_projector_world);
  void addSteps(LightLayer& out);
  bool isOpaqueStep(const LightStep& step) const;
  LightVertex lightVertex(const CutVertex& vertex, const Placed& placed) const;
  std::uint32_t addVertex(const CutVertex& vertex, const Placed& placed);

  calib::Lens lens_;
  LensDomain domain_;
  TriangleCutter cutter_;
  LightFrame frame_;
  Tessellation tessellation_;
  std::vector<CutVertex> cut_vertices_, thin_;
  std::vector<char> inside_;
  std::vector<OutlinePoint> outline_points_;
  std::vector<std::uint32_t> index_of_;
  std::vector<Sorted> steps_;

  ReliefPlacer relief_placer_;
  ReliefPlacer* placer_ = nullptr;  ///< there for layers on a relief
  LaidMesh laid_;

  PointProjector point_projector_;
  SpriteProjector sprite_projector_;
  Workers* workers_ = nullptr;
  std::size_t screen_point_count_ = 0;
  std::vector<const SurfacePatch*> masked_;  ///< whose mask is where in frame_.masks
};

}  // namespace afterglow::render
