// Light that is meant for one surface reaches no other: the ray of every pixel is cast into the
// room, and the surface that it meets first must be the one that the pixel was lit for.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "render/scene/triangulate.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/image_measures.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render::surface_occlusion_gl_test {
namespace {

constexpr std::size_t kNone = ~std::size_t{0};

SurfacePatch patch(const std::string& name, const Eigen::Vector3d& at, double tilt,
                   std::vector<Eigen::Vector2d> polygon) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = at;
  T.linear() = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()).toRotationMatrix();
  return {name, Rigid<World, Surface>(T), std::move(polygon)};
}

std::vector<Eigen::Vector2d> rectangle(double width, double depth) {
  const double x = width / 2, y = depth / 2;
  return {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
}

/// Floor, an L-shaped table, a shelf over the table, a board that leans behind it.
std::vector<SurfacePatch> room() {
  return {patch("floor", {0, 1.5, 0}, 0, rectangle(4, 3)),
          patch("table", {0.1, 1.3, 0.5}, 0,
                {{-0.4, -0.3}, {0.4, -0.3}, {0.4, 0.0}, {0.0, 0.0}, {0.0, 0.3}, {-0.4, 0.3}}),
          patch("shelf", {-0.2, 1.3, 0.8}, 0.1, rectangle(0.25, 0.2)),
          patch("board", {0.5, 2.1, 0.4}, 1.2, rectangle(0.6, 0.5))};
}

class SurfaceOcclusion : public test::GlTest {
 protected:
  /// Index of the surface that is lit by the pixel.
  std::size_t firstHit(const Eigen::Vector2d& pixel) const {
    const auto ray = calib::unproject(lens_, pixel);
    if (!ray) return kNone;
    const Eigen::Vector3d eye = T_world_projector_ * Eigen::Vector3d::Zero();
    const Eigen::Vector3d way = T_world_projector_ * *ray - eye;
    std::size_t first = kNone;
    double nearest = 1e9;
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
      const Eigen::Isometry3d T = surfaces_[i].T_world_surface.matrix().inverse();
      const Eigen::Vector3d from = T * eye, along = T.linear() * way;
      const double share = -from.z() / along.z();
      const Eigen::Vector2d p = (from + share * along).head<2>();
      if (share > 0 && share < nearest && isInside(surfaces_[i].polygon, p)) {
        nearest = share;
        first = i;
      }
    }
    return first;
  }
  /// The same, if it is the same all around: no edge passes here.
  std::optional<std::size_t> surelyHit(int u, int v) const {
    const std::size_t here = firstHit({u, v});
    for (const double du : {-1.0, 1.0}) {
      for (const double dv : {-1.0, 1.0}) {
        if (firstHit({u + du, v + dv}) != here) return std::nullopt;
      }
    }
    return here;
  }
  /// White everywhere on the surface and far over it.
  Layer layerFor(std::size_t surface) const {
    Layer layer;
    layer.name = surfaces_[surface].name;
    layer.placement = Placement::Drape;
    layer.surface = surfaces_[surface];
    const Cube slab{Eigen::Vector3f(9, 9, 0.01f)};
    layer.drawables = {{Rigid<World, World>(layer.surface->T_world_surface.matrix()), slab, {}}};
    return layer;
  }
  /// Each surface alone: what it lights must meet it, and what meets it must be lit.
  void expectNoSpill(Drawing drawing) {
    ProjectorRenderer renderer(context(), lens_, drawing);
    for (std::size_t surface = 0; surface < surfaces_.size(); ++surface) {
      Scene scene;
      scene.layers = {layerFor(surface)};
      scene.surfaces = surfaces_;
      const Image image = renderer.render(scene, T_world_projector_.inverse());
      int lit = 0, spilled = 0, missing = 0;
      for (int v = 1; v < lens_.height - 1; v += 3) {
        for (int u = 1; u < lens_.width - 1; u += 3) {
          const auto hit = surelyHit(u, v);
          if (!hit) continue;
          const bool is_lit = test::brightness(image, u, v) > 0.5;
          lit += is_lit ? 1 : 0;
          spilled += is_lit && *hit != surface ? 1 : 0;
          missing += !is_lit && *hit == surface ? 1 : 0;
        }
      }
      EXPECT_GT(lit, 200) << surfaces_[surface].name;
      EXPECT_EQ(spilled, 0) << surfaces_[surface].name << ": pixels that light another surface";
      EXPECT_EQ(missing, 0) << surfaces_[surface].name << ": pixels dark without reason";
    }
  }

  std::vector<SurfacePatch> surfaces_ = room();
  calib::Lens lens_ = test::lens(640, 480, 420, 330, 300, {-0.15, 0.03, 0.001, -0.001, 0});
  Rigid<World, Projector> T_world_projector_ =
      test::lookAt<Projector>({0.1, 0, 1.5}, {0.1, 1.4, 0.3});
};

TEST_F(SurfaceOcclusion, lightForASurfaceReachesNoOther) {
  for (const Drawing drawing : {Drawing::Cpu, Drawing::Gl}) {
    SCOPED_TRACE(drawing == Drawing::Cpu ? "cpu" : "gl");
    expectNoSpill(drawing);
  }
}

TEST_F(SurfaceOcclusion, alsoWhereASurfaceReachesBehindTheLens) {
  // Looking straight down, with a table that begins behind the projector and one above it.
  T_world_projector_ = test::lookAt<Projector>({0, 1.2, 1.2}, {0, 1.6, 0}, {0, 1, 0.1});
  surfaces_ = {patch("floor", {0, 1.5, 0}, 0, rectangle(3, 3)),
               patch("ramp", {0.25, 1.3, 0.9}, 0.7, rectangle(0.5, 1.8)),
               patch("ceiling", {0, 1.5, 2.4}, 0, rectangle(6, 6))};
  const auto ceiling = surfaces_.back();
  surfaces_.pop_back();
  expectNoSpill(Drawing::Cpu);
  Scene scene;
  scene.layers = {layerFor(0)};
  scene.surfaces = surfaces_;
  ProjectorRenderer renderer(context(), lens_);
  const Image without = renderer.render(scene, T_world_projector_.inverse());
  scene.surfaces.push_back(ceiling);
  EXPECT_EQ(renderer.render(scene, T_world_projector_.inverse()).rgb, without.rgb);
}

TEST_F(SurfaceOcclusion, directLightFindsItsOwnWay) {
  Scene scene;
  Layer layer = layerFor(1);
  layer.placement = Placement::Direct;
  layer.surface.reset();
  scene.layers = {layer};
  ProjectorRenderer renderer(context(), lens_);
  const Image alone = renderer.render(scene, T_world_projector_.inverse());
  scene.surfaces = surfaces_;
  EXPECT_EQ(renderer.render(scene, T_world_projector_.inverse()).rgb, alone.rgb);
}

}  // namespace
}  // namespace afterglow::render::surface_occlusion_gl_test
