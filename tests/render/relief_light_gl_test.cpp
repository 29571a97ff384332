// Content on a relief, by where its light falls: the ray of every pixel is cast on the relief, and
// must be lit just where the content is over it, or between it and the viewer.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "render/scene/relief.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/image_measures.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render::relief_light_gl_test {
namespace {

const Eigen::Vector3d kBox(0.35, 0.25, 0.06);
constexpr double kTouch = 0.02;  // m; how near to a place a ray must arrive to have reached it

class ReliefLight : public test::GlTest {
 protected:
  /// Two steps and a bump, 1 m x 1 m, around its frame's origin.
  static std::shared_ptr<const Relief> makeRelief() {
    std::vector<float> heights;
    for (int row = 0; row <= 100; ++row) {
      for (int column = 0; column <= 100; ++column) {
        const double x = column * 0.01 - 0.5, y = row * 0.01 - 0.5;
        const double r = std::hypot(x + 0.1, y - 0.05) / 0.2;
        const double bump = r < 1 ? 0.08 * (1 + std::cos(r * M_PI)) / 2 : 0;
        heights.push_back(static_cast<float>(bump + (x > 0.2 ? 0.06 : x > 0.12 ? 0.03 : 0)));
      }
    }
    return std::make_shared<Relief>(Eigen::Vector2d(-0.5, -0.5), 0.01, 101, 101, heights);
  }

  static Eigen::Isometry3d pose(const Eigen::Vector3d& at, double yaw) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() = at;
    T.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return T;
  }

  Layer makeLayer(Placement placement) const {
    Layer layer;
    layer.placement = placement;
    layer.surface = SurfacePatch{"table", Rigid<World, Surface>(T_world_table_), {}, makeRelief()};
    layer.p_viewer = T_world_table_ * p_viewer_;
    layer.drawables = {
        {Rigid<World, World>(T_world_table_ * T_table_box_), Cube{kBox.cast<float>()}, {}}};
    return layer;
  }

  /// Whether the straight way between two points of the box's frame goes through it.
  static bool meetsBox(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double margin) {
    const Eigen::Array3d half = kBox.array() / 2 + margin;
    const Eigen::Array3d way = (to - from).array();
    const Eigen::Array3d a = (-half - from.array()) / way, b = (half - from.array()) / way;
    return a.min(b).maxCoeff() <= a.max(b).minCoeff();
  }

  /// Whether light on this point of the relief is the box's; margin: of a box so much larger.
  bool isMeant(const Layer& layer, const Eigen::Vector3d& p_table, double margin) const {
    const Eigen::Isometry3d T_box_table = T_table_box_.inverse();
    const Eigen::Vector3d p = T_box_table * p_table;
    if (layer.placement == Placement::Viewer) {
      const auto seen = layer.surface->relief->firstHit(p_viewer_, p_table - p_viewer_);
      const bool is_seen = seen && (*seen - p_table).norm() < kTouch;
      return is_seen && meetsBox(p, T_box_table * p_viewer_, margin);
    }
    const Eigen::Array2d half = kBox.head<2>().array() / 2 + margin;
    return (p.head<2>().array().abs() <= half).all();
  }

  void expectLight(Placement placement) {
    const Layer layer = makeLayer(placement);
    Scene scene;
    scene.layers = {layer};
    scene.surfaces = {*layer.surface};
    const Image image =
        ProjectorRenderer(context(), lens_).render(scene, T_world_projector_.inverse());
    const Eigen::Isometry3d T_table_projector =
        T_world_table_.inverse() * T_world_projector_.matrix();
    constexpr double kMargin = 0.005;  // two pixels
    int lit = 0, wrong = 0, missing = 0;
    for (int v = 0; v < lens_.height; v += 2) {
      for (int u = 0; u < lens_.width; u += 2) {
        const Eigen::Vector3d ray = *calib::unproject(lens_, {u, v});
        const auto hit = layer.surface->relief->firstHit(T_table_projector.translation(),
                                                         T_table_projector.linear() * ray);
        const bool is_lit = test::brightness(image, u, v) > 0.5;
        lit += is_lit ? 1 : 0;
        wrong += is_lit && !(hit && isMeant(layer, *hit, kMargin)) ? 1 : 0;
        missing += !is_lit && hit && isMeant(layer, *hit, -kMargin) ? 1 : 0;
      }
    }
    EXPECT_GT(lit, 1500);
    // Where the bump begins to hide it from the viewer the nodes around decide.
    const int slivers = placement == Placement::Viewer ? lit / 500 : 0;
    EXPECT_LE(wrong, slivers);
    EXPECT_LE(missing, slivers);
  }

  calib::Lens lens_ = test::lens(640, 480, 600, 310, 280, {-0.1, 0.02, 0.001, 0, 0});
  Rigid<World, Projector> T_world_projector_ =
      test::lookAt<Projector>({0, 0, 1.6}, {0.1, 0.9, 0.6});
  Eigen::Isometry3d T_world_table_ = pose({0.1, 0.9, 0.6}, 0.4);
  Eigen::Isometry3d T_table_box_ = pose({0.02, 0.02, 0.2}, 0.3);
  Eigen::Vector3d p_viewer_{0.9, -1.0, 1.3};
};

TEST_F(ReliefLight, drapeFallsStraightDownOnWhatIsThere) { expectLight(Placement::Drape); }

TEST_F(ReliefLight, viewerSeesTheBoxWhereItIs) { expectLight(Placement::Viewer); }

}  // namespace
}  // namespace afterglow::render::relief_light_gl_test
