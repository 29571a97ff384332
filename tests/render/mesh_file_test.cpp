// Mesh files: a cube in every format, and what is refused.
#include "render/mesh_file.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "tests/support/cube_files.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::render::mesh_file_test {
namespace {

using test::writeFile;

class MeshFile : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& content) {
    writeFile(folder_.path(name), content);
    return folder_.path(name);
  }
  Body load(const std::string& path, const MeshFileLimits& limits = {}) {
    return loadMeshFile(path, folder_.path(""), limits);
  }
  std::string refusal(const std::string& path, const MeshFileLimits& limits = {}) {
    try {
      load(path, limits);
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      return error.what();
    }
    return "not refused";
  }
  static void expectCube(const Body& body, const Color& color) {
    Eigen::AlignedBox3f box;
    for (const auto& p : body.points) box.extend(p);
    EXPECT_TRUE(box.min().isApprox(Eigen::Vector3f::Constant(-0.5f), 1e-5f)) << box.min();
    EXPECT_TRUE(box.max().isApprox(Eigen::Vector3f::Constant(0.5f), 1e-5f)) << box.max();
    EXPECT_EQ(body.triangles.size(), 12u);
    EXPECT_EQ(body.points.size(), 8u);  // corners are shared
    ASSERT_EQ(body.colors.size(), body.points.size());
    const Color& c = body.colors.front();
    EXPECT_TRUE(c == color) << c.r << ' ' << c.g << ' ' << c.b << ' ' << c.a;
    double area = 0;
    for (const auto& t : body.triangles) {
      const auto &a = body.points[t[0]], &b = body.points[t[1]], &d = body.points[t[2]];
      area += static_cast<double>((b - a).cross(d - a).norm()) / 2;
    }
    EXPECT_NEAR(area, 6, 1e-4);
  }

  test::TempFolder folder_;
};

TEST_F(MeshFile, readsACubeOfEveryKind) {
  expectCube(load(write("a.obj", test::cubeObj("paint.mtl"))), {0.6f, 0.6f, 0.6f, 1});
  write("paint.mtl", "newmtl paint\nKd 0 1 0\nd 0.25\n");
  expectCube(load(write("cube.obj", test::cubeObj("paint.mtl"))), {0, 1, 0, 0.25f});
  expectCube(load(write("cube.dae", test::cubeDae())), {1, 0, 0, 1});
  write("cube.bin", test::cubeGltfBuffer());
  expectCube(load(write("cube.gltf", test::cubeGltf("cube.bin"))), {0, 0, 1, 0.5f});
}

TEST_F(MeshFile, readsBothKindsOfStl) {
  for (const auto& content : {test::cubeStl(), test::cubeBinaryStl()}) {
    const Body body = load(write("Cube.STL", content));
    EXPECT_EQ(body.triangles.size(), 12u);
    EXPECT_EQ(body.points.size(), 8u);
  }
}

TEST_F(MeshFile, appliesACollada_sUnitButNotItsUpAxis) {
  const Body body = load(write("mm.dae", test::cubeDae(0.001)));
  expectCube(body, {1, 0, 0, 1});
}

TEST_F(MeshFile, refusesFilesItCannotTrust) {
  EXPECT_EQ(refusal(folder_.path("none.stl")), "no such file");
  EXPECT_EQ(refusal(write("a.fbx", "x")), "not one of .stl, .dae, .obj, .gltf, .glb");
  EXPECT_EQ(refusal(write("lies.stl", test::cubeBinaryStl(1'000'000'000))),
            "malformed: shorter than its number of triangles says");
  for (const char* name : {"a.stl", "a.dae", "a.gltf", "a.glb"}) {
    for (const std::string& content :
         {std::string(), std::string("solid x\nfacet nonsense"), std::string(500, '\xff'),
          std::string("<COLLADA><library"), std::string("{\"asset\":{")}) {
      const std::string why = refusal(write(name, content));
      EXPECT_TRUE(why.rfind("malformed: ", 0) == 0 || why == "no triangles") << name << ": " << why;
    }
  }
  std::string endless = test::cubeDae();
  endless[endless.find("<p>") + 10] = '\xef';
  EXPECT_EQ(refusal(write("endless.dae", endless)),
            "malformed: an index list holds more than numbers");
  EXPECT_NE(refusal(write("empty.obj", "v 0 0 0\n")), "not refused");
  EXPECT_NE(refusal(write("index.obj", "v 0 0 0\nf 1 2 900000000\n")), "not refused");
  EXPECT_NE(refusal(write("cut.gltf", test::cubeGltf("none.bin"))), "not refused");
}

TEST_F(MeshFile, refusesFilesThatAreTooLarge) {
  const std::string path = write("cube.obj", test::cubeObj());
  EXPECT_EQ(refusal(path, {std::uintmax_t{64} << 20, 11}), "more than 11 triangles");
  std::filesystem::resize_file(path, std::uintmax_t{65} << 20);
  EXPECT_EQ(refusal(path), "larger than 64 MiB");
}

TEST_F(MeshFile, staysInItsFolder) {
  const std::string outside = write("cube.stl", test::cubeStl());
  std::filesystem::create_directory(folder_.path("in"));
  const auto why = [&](const std::string& path) {
    try {
      loadMeshFile(path, folder_.path("in"));
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string("not refused");
  };
  EXPECT_EQ(why(outside), "outside the folders meshes may come from");
  EXPECT_EQ(why(folder_.path("in/../cube.stl")), "outside the folders meshes may come from");
  std::filesystem::create_symlink(outside, folder_.path("in/link.stl"));
  EXPECT_EQ(why(folder_.path("in/link.stl")), "outside the folders meshes may come from");
  // Nor does what a file names lead out.
  write("cube.bin", test::cubeGltfBuffer());
  write("in/cube.gltf", test::cubeGltf("../cube.bin"));
  EXPECT_NE(why(folder_.path("in/cube.gltf")), "not refused");
}

}  // namespace
}  // namespace afterglow::render::mesh_file_test
