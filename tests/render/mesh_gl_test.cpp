// A mesh file's cube gives the CUBE's image.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <string>

#include "render/mesh_file.hpp"
#include "tests/support/cube_files.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/image_measures.hpp"
#include "tests/support/optics.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::render::mesh_gl_test {
namespace {

class ProjectedMesh : public test::GlTest {
 protected:
  Image draw(const Shape& shape, const Color& color) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    Layer layer;
    layer.drawables = {{Rigid<World, World>(pose), shape, color}};
    const auto T = test::lookAt<Projector>({-1.5, -0.6, 1.1}, {0, 0, -0.4}).inverse();
    return ProjectorRenderer(context(), test::viewsonic({-0.35, 0.12, 0.002, -0.0015, -0.03}))
        .render({{layer}}, T);
  }
  SharedBody load(const std::string& name, const std::string& content) {
    test::writeFile(folder_.path(name), content);
    return std::make_shared<const Body>(loadMeshFile(folder_.path(name), folder_.path("")));
  }
  test::TempFolder folder_;
};

int greatestDifference(const Image& a, const Image& b) {
  int greatest = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) {
    greatest = std::max(greatest, std::abs(a.rgb[i] - b.rgb[i]));
  }
  return greatest;
}

TEST_F(ProjectedMesh, ofACubeIsTheCube) {
  const Eigen::Vector3f size(0.3f, 0.2f, 0.15f);
  const Color color{1, 0.5f, 0, 1};
  const Image cube = draw(Cube{size}, color);
  ASSERT_GT(test::litPixels(cube), 10'000);
  test::writeFile(folder_.path("cube.bin"), test::cubeGltfBuffer());
  for (const auto& [name, content] : {std::pair<std::string, std::string>{"a.stl", test::cubeStl()},
                                      {"b.stl", test::cubeBinaryStl()},
                                      {"cube.obj", test::cubeObj()},
                                      {"cube.dae", test::cubeDae(0.01)},
                                      {"cube.gltf", test::cubeGltf("cube.bin")}}) {
    const Image mesh = draw(MeshInstance{load(name, content), size, false}, color);
    EXPECT_LE(greatestDifference(mesh, cube), 2) << name;
  }
}

TEST_F(ProjectedMesh, showsItsOwnColorsOrTintsThem) {
  const Eigen::Vector3f size(0.3f, 0.2f, 0.15f);
  const SharedBody red = load("red.dae", test::cubeDae());
  EXPECT_LE(
      greatestDifference(draw(MeshInstance{red, size, true}, {}), draw(Cube{size}, {1, 0, 0, 1})),
      2);
  EXPECT_LE(greatestDifference(draw(MeshInstance{red, size, true}, {0.5f, 1, 1, 1}),
                               draw(Cube{size}, {0.5f, 0, 0, 1})),
            2);
}

}  // namespace
}  // namespace afterglow::render::mesh_gl_test
