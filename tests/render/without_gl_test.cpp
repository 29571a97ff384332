// A build without OpenGL: the CPU draws, and whoever needs OpenGL is told so in one line. This
// program has render/gl/without_gl.cpp in whichever build.
#include <gtest/gtest.h>

#include <functional>
#include <stdexcept>

#include "render/gl/observer_renderer.hpp"
#include "render/gl/window.hpp"
#include "render/projector_renderer.hpp"
#include "tests/support/image_measures.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render::without_gl_test {
namespace {

const calib::Lens kLens = test::lens(160, 100, 150, 80, 60);
const std::string kReason = "this build has no OpenGL: configure with AFTERGLOW_WITH_GL=ON";

TEST(WithoutGl, theCpuDrawsWhetherToldSoOrFoundOut) {
  GlContext context;
  Layer layer;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().z() = 1;
  layer.drawables = {{Rigid<World, World>(T), Cube{Eigen::Vector3f::Constant(0.2f)}, {}}};
  for (const Drawing drawing : {Drawing::Cpu, Drawing::Measured}) {
    ProjectorRenderer renderer(context, kLens, drawing);
    EXPECT_NEAR(test::whiteArea(renderer.render({{layer}}, {})), std::pow(150 * 0.2 / 0.9, 2), 1);
    EXPECT_EQ(renderer.description(), drawing == Drawing::Cpu
                                          ? "drawn by the CPU (configured)"
                                          : "drawn by the CPU (" + kReason + ")");
  }
}

/// In memory that its user has changed, in another size, from another place.
TEST(WithoutGl, aSceneThatStaysLooksAsIfItWereDrawnEachTime) {
  GlContext context;
  Layer layer;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().z() = 1;
  layer.drawables = {{Rigid<World, World>(T), Cube{Eigen::Vector3f::Constant(0.2f)}, {}}};
  const Scene scene{{layer}};
  layer.drawables[0].color = {1, 0, 0, 1};
  const Scene red{{layer}};
  T.translation().x() = 0.1;
  const Rigid<Projector, World> elsewhere(T);
  const auto fresh = [&](const Scene& of, const Rigid<Projector, World>& pose) {
    return ProjectorRenderer(context, kLens).render(of, pose).rgb;
  };
  ProjectorRenderer renderer(context, kLens);
  Image image;
  const auto expectFresh = [&](const Scene& of, const Rigid<Projector, World>& pose) {
    for (int i = 0; i < 4; ++i) {
      renderer.render(of, pose, image);
      EXPECT_EQ(image.rgb, fresh(of, pose)) << "time " << i;
      image.width = 1;
      image.rgb.assign(i == 2 ? 7 : image.rgb.size(), 99);
    }
    renderer.render(of, pose, image);
    EXPECT_EQ(image.width, kLens.width);
  };
  expectFresh(scene, {});
  expectFresh(red, {});
  expectFresh(red, elsewhere);
  expectFresh({}, elsewhere);
  expectFresh(scene, {});
  for (const int times : {2, 2, 1, 1, 2}) {
    for (const Scene& of : {red, scene}) {
      for (int i = 0; i < times; ++i) {
        renderer.render(of, {}, image);
        EXPECT_EQ(image.rgb, fresh(of, {})) << "time " << i << " of " << times;
      }
    }
  }
}

void expectRefusal(const std::function<void()>& use, const std::string& expected) {
  try {
    use();
    ADD_FAILURE() << "not refused";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(error.what(), expected);
  }
}

TEST(WithoutGl, whatNeedsItIsRefusedInOneLine) {
  GlContext context;
  expectRefusal([&] { ProjectorRenderer(context, kLens, Drawing::Gl); }, kReason);
  expectRefusal([&] { ObserverRenderer renderer(context); }, "no view of the room: " + kReason);
  expectRefusal([&] { Window("title", 160, 100); }, "no window: " + kReason);
  expectRefusal([&] { Window::fullScreen("", "title", 160, 100); }, "no window: " + kReason);
}

}  // namespace
}  // namespace afterglow::render::without_gl_test
