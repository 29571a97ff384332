// Text and meshes of markers: what messages may name, what is refused and how, whose letters.
#include "nodes/conversion/marker_conversion.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/support/cube_files.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::marker_assets_test {
namespace {

using visualization_msgs::Marker;

Marker marker(int type) {
  Marker m;
  m.type = type;
  m.scale.x = m.scale.y = m.scale.z = 0.5;
  m.color.g = m.color.a = 1;
  return m;
}

TEST(TextMarkers, becomeLettersOfTheirHeight) {
  MarkerAssets assets;
  Marker m = marker(Marker::TEXT_VIEW_FACING);
  m.text = "H\xc3\xa4\xffH";
  const auto drawable = toDrawable(m, assets);
  ASSERT_TRUE(drawable.value) << drawable.reason;
  EXPECT_EQ(drawable.value->color, (render::Color{0, 1, 0, 1}));
  const auto& letters = *std::get<render::Text>(drawable.value->shape).letters;
  EXPECT_GT(letters.triangles.size(), 20u);
}

TEST(TextMarkers, shareLettersWhileTheyAreShown) {
  MarkerAssets assets;
  const auto first = assets.text("same", 0.1).value;
  EXPECT_EQ(assets.text("same", 0.1).value, first);
  EXPECT_NE(assets.text("same", 0.2).value, first);
  EXPECT_NE(assets.text("other", 0.1).value, first);
  for (int i = 0; i < 1000; ++i) assets.text("text " + std::to_string(i), 0.1);
  EXPECT_EQ(assets.text("same", 0.1).value, first);  // what is shown is not forgotten
}

TEST(TextMarkers, areRefusedWhenTheyCannotBeRead) {
  MarkerAssets assets;
  Marker m = marker(Marker::TEXT_VIEW_FACING);
  m.text = std::string(10'000'000, 'x');
  EXPECT_EQ(toDrawable(m, assets).reason, "text of more than 4096 characters");
  m.text = std::string(4097, 'x');
  EXPECT_EQ(toDrawable(m, assets).reason, "text of more than 4096 characters");
  m.text = std::string(4096, 'x');
  EXPECT_TRUE(toDrawable(m, assets).value);
  for (const double height : {0.0, -1.0}) {
    m.scale.z = height;
    EXPECT_EQ(toDrawable(m, assets).reason, "text height (scale.z) is not positive");
  }
}

TEST(TextMarkers, drawNothingWhenEmpty) {
  MarkerAssets assets;
  const auto drawable = toDrawable(marker(Marker::TEXT_VIEW_FACING), assets);
  ASSERT_TRUE(drawable.value);
  EXPECT_EQ(drawable.reason, "text is empty");
  EXPECT_TRUE(std::get<render::Text>(drawable.value->shape).letters->triangles.empty());
}

class MeshMarkers : public ::testing::Test {
 protected:
  MeshMarkers() : assets_({folder_.path("")}) {
    test::writeFile(folder_.path("cube.stl"), test::cubeStl());
    test::writeFile(folder_.path("red.dae"), test::cubeDae());
  }
  std::string uri(const std::string& name) const { return "file://" + folder_.path(name); }
  Converted<render::Drawable> convert(const std::string& resource, bool embedded = false,
                                      const std_msgs::ColorRGBA& color = {}) {
    Marker m = marker(Marker::MESH_RESOURCE);
    m.mesh_resource = resource;
    m.mesh_use_embedded_materials = embedded;
    m.color = color;
    return toDrawable(m, assets_);
  }
  std::string refusal(const std::string& resource) {
    const auto drawable = convert(resource);
    EXPECT_FALSE(drawable.value) << resource;
    return drawable.reason;
  }

  test::TempFolder folder_;
  MarkerAssets assets_;
};

TEST_F(MeshMarkers, areReadOnceAndShared) {
  const auto first = convert(uri("cube.stl"));
  ASSERT_TRUE(first.value) << first.reason;
  std::filesystem::remove(folder_.path("cube.stl"));
  const auto second = convert(uri("cube.stl"));
  ASSERT_TRUE(second.value) << second.reason;
  const auto& mesh = std::get<render::MeshInstance>(first.value->shape);
  EXPECT_EQ(mesh.body, std::get<render::MeshInstance>(second.value->shape).body);
  EXPECT_EQ(mesh.scale, Eigen::Vector3f::Constant(0.5f));
  EXPECT_FALSE(mesh.own_colors);
}

TEST_F(MeshMarkers, bringTheirColorsWhereAskedTo) {
  const auto untinted = convert(uri("red.dae"), true);
  ASSERT_TRUE(untinted.value) << untinted.reason;
  EXPECT_TRUE(std::get<render::MeshInstance>(untinted.value->shape).own_colors);
  EXPECT_EQ(untinted.value->color, render::Color{});
  std_msgs::ColorRGBA tint;
  tint.g = tint.a = 0.5f;
  EXPECT_EQ(convert(uri("red.dae"), true, tint).value->color, (render::Color{0, 0.5f, 0, 0.5f}));
  // Transparent without embedded materials is what it says.
  EXPECT_EQ(convert(uri("red.dae"), false).value->color.a, 0);
}

TEST_F(MeshMarkers, areFoundInTheirPackage) {
  std::filesystem::create_directories(folder_.path("packages/afterglow_cube/meshes"));
  test::writeFile(folder_.path("packages/afterglow_cube/package.xml"),
                  "<package format=\"2\"><name>afterglow_cube</name><version>1.0.0</version>"
                  "<description>d</description><maintainer email=\"a@b.cd\">m</maintainer>"
                  "<license>l</license></package>");
  test::writeFile(folder_.path("packages/afterglow_cube/meshes/cube.stl"), test::cubeStl());
  setenv("ROS_PACKAGE_PATH", folder_.path("packages").c_str(), 1);
  const auto drawable = convert("package://afterglow_cube/meshes/cube.stl");
  EXPECT_TRUE(drawable.value) << drawable.reason;
  EXPECT_EQ(refusal("package://afterglow_cube/meshes/none.stl"),
            "mesh 'package://afterglow_cube/meshes/none.stl': no such file");
  EXPECT_EQ(refusal("package://afterglow_none/cube.stl"),
            "mesh 'package://afterglow_none/cube.stl': there is no ROS package of that name");
  // Without configured folders, file:// leads into packages and nowhere else.
  MarkerAssets by_default;
  const auto in_package = by_default.meshes().get(uri("packages/afterglow_cube/meshes/cube.stl"));
  EXPECT_TRUE(in_package.value) << in_package.reason;
  EXPECT_FALSE(by_default.meshes().get(uri("cube.stl")).value);
}

TEST_F(MeshMarkers, areRefusedOutsideAndOtherwise) {
  EXPECT_EQ(refusal(""), "no mesh_resource");
  EXPECT_EQ(refusal(std::string(5000, 'x')), "mesh_resource is longer than 1024 characters");
  EXPECT_EQ(refusal("http://a/b.stl"), "mesh 'http://a/b.stl': neither package:// nor file://");
  EXPECT_EQ(refusal("file:///etc/passwd"),
            "mesh 'file:///etc/passwd': outside the folders meshes may come from (mesh_roots)");
  EXPECT_EQ(refusal("file://x/../cube.stl"), "mesh 'file://x/../cube.stl': '..' is not followed");
  EXPECT_EQ(refusal("package://roscpp/../../cube.stl"),
            "mesh 'package://roscpp/../../cube.stl': '..' is not followed");
  EXPECT_EQ(refusal("package://"), "mesh 'package://': not package://NAME/PATH");
  EXPECT_EQ(refusal("package:///etc/passwd"),
            "mesh 'package:///etc/passwd': not package://NAME/PATH");
  test::writeFile(folder_.path("bad.stl"), test::cubeBinaryStl(1'000'000));
  EXPECT_NE(refusal(uri("bad.stl")).find("malformed: shorter than its number of triangles says"),
            std::string::npos);
  EXPECT_EQ(refusal(std::string("file:///a\0b", 11)).find('\0'), std::string::npos);
}

}  // namespace
}  // namespace afterglow::nodes::marker_assets_test
