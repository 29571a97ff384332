// The context, and what shaders say that do not compile.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include "render/gl/shader.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/image_measures.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render::gl_context_gl_test {
namespace {

using GlContextTest = test::GlTest;

TEST_F(GlContextTest, saysWhatItIs) {
  EXPECT_NE(context().description().find("4.5"), std::string::npos) << context().description();
}

TEST_F(GlContextTest, severalTakeTurnsInAThread) {
  const calib::Lens lens = test::viewsonic();
  Layer layer;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << 0, -0.3, 1.5;
  layer.drawables = {{Rigid<World, World>(T), Cube{Eigen::Vector3f::Constant(0.1f)}, {}}};
  ProjectorRenderer first(context(), lens, Drawing::Gl);
  const Image expected = first.render({{layer}}, {});
  {
    GlContext other;
    ProjectorRenderer second(other, lens, Drawing::Gl);
    EXPECT_EQ(second.render({{layer}}, {}).rgb, expected.rgb);
    EXPECT_EQ(first.render({{layer}}, {}).rgb, expected.rgb);
    EXPECT_EQ(second.render({{layer}}, {}).rgb, expected.rgb);
  }
  EXPECT_EQ(first.render({{layer}}, {}).rgb, expected.rgb) << "after the other one has gone";
}

/// A driver that says so; none can be made to reset its GPU.
struct LostContext {
  LostContext() {
    glGetGraphicsResetStatus = [] { return static_cast<GLenum>(GL_GUILTY_CONTEXT_RESET); };
  }
  ~LostContext() { glGetGraphicsResetStatus = real; }
  decltype(glGetGraphicsResetStatus) real = glGetGraphicsResetStatus;
};

TEST_F(GlContextTest, drawsOnByTheCpuWhenItIsLost) {
  const calib::Lens lens = test::viewsonic();
  Layer layer;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << 0, -0.3, 1.5;
  layer.drawables = {{Rigid<World, World>(T), Cube{Eigen::Vector3f::Constant(0.1f)}, {}}};
  ProjectorRenderer renderer(context(), lens, Drawing::Gl);
  renderer.render({{layer}}, {});
  EXPECT_EQ(renderer.description().rfind("drawn by OpenGL", 0), 0u) << renderer.description();
  {
    const LostContext lost;
    EXPECT_EQ(renderer.render({{layer}}, {}).rgb,
              ProjectorRenderer(context(), lens, Drawing::Cpu).render({{layer}}, {}).rgb);
  }
  EXPECT_EQ(renderer.description(), "drawn by the CPU (OpenGL's context was lost)");
}

TEST_F(GlContextTest, compileErrorsNameFileAndLine) {
  try {
    makeProgram(
        {{GL_FRAGMENT_SHADER, {"room_light.glsl", "sent_light.glsl"}}});  // lens.glsl is missing
    FAIL() << "compiled";
  } catch (const std::runtime_error& error) {
    const std::string text = error.what();  // the rest of it is each driver's own
    EXPECT_NE(text.find("sent_light.glsl:7"), std::string::npos) << text;
  }
  EXPECT_THROW(makeProgram({{GL_VERTEX_SHADER, {"none.vert"}}}), std::logic_error);
}

}  // namespace
}  // namespace afterglow::render::gl_context_gl_test
