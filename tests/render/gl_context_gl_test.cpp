// The context, and what shaders say that do not compile.
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

TEST_F(GlContextTest, compileErrorsNameFileAndLine) {
  try {
    makeProgram({{GL_FRAGMENT_SHADER, {"room_light.glsl", "lit.frag"}}});  // lens.glsl is missing
    FAIL() << "compiled";
  } catch (const std::runtime_error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("lit.frag:28("), std::string::npos) << text;
  }
  EXPECT_THROW(makeProgram({{GL_VERTEX_SHADER, {"none.vert"}}}), std::logic_error);
}

}  // namespace
}  // namespace afterglow::render::gl_context_gl_test
