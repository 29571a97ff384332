// Mesh files that were tampered with bring down the program that reads them, never this one.
#include "nodes/conversion/mesh_library.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <future>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "nodes/tools/program.hpp"
#include "tests/support/cube_files.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::mesh_reader_test {
namespace {

class MeshReader : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& content) {
    test::writeFile(folder_.path(name), content);
    return folder_.path(name);
  }
  /// Empty: it was read.
  std::string refusal(const std::string& path, const render::MeshFileLimits& limits = {}) {
    try {
      EXPECT_FALSE(readMeshFile(path, folder_.path(""), limits).triangles.empty());
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return {};
  }

  test::TempFolder folder_;
};

TEST_F(MeshReader, bringsWhatTheFileHolds) {
  const render::Body apart = readMeshFile(write("cube.dae", test::cubeDae()), folder_.path(""), {});
  const render::Body here = render::loadMeshFile(folder_.path("cube.dae"), folder_.path(""));
  EXPECT_EQ(apart.points, here.points);
  EXPECT_EQ(apart.colors, here.colors);
  EXPECT_EQ(apart.triangles, here.triangles);
  EXPECT_EQ(apart.is_closed, here.is_closed);
}

/// A node that has two of the one before it, and so on: 5 kB that grow to 2^40 nodes, and took 3 GB.
TEST_F(MeshReader, boundsTheMemoryOfAFileThatGrows) {
  std::string dae = test::cubeDae();
  std::string nodes = "<library_nodes><node id=\"n0\"><instance_geometry url=\"#g\"/></node>";
  for (int i = 1; i <= 40; ++i) {
    const std::string before = "<instance_node url=\"#n" + std::to_string(i - 1) + "\"/>";
    nodes += "<node id=\"n" + std::to_string(i) + "\">" + before + before + "</node>";
  }
  dae.insert(dae.find("<library_visual_scenes>"), nodes + "</library_nodes>");
  const std::string scene = "<visual_scene id=\"s1\">";
  dae.insert(dae.find(scene) + scene.size(), "<node><instance_node url=\"#n40\"/></node>");
  const std::string reason = refusal(write("grows.dae", dae));
  EXPECT_EQ(reason, "takes more than 1 GiB of memory to read");
  rusage used{};
  getrusage(RUSAGE_CHILDREN, &used);
  EXPECT_LT(used.ru_maxrss, 1 << 20) << "KiB";
}

TEST_F(MeshReader, passesOnLimitsAndReasons) {
  const std::string path = write("cube.obj", test::cubeObj());
  EXPECT_EQ(refusal(path, {100, 1000}), "larger than 0 MiB");
  EXPECT_EQ(refusal(path, {1000, 11}), "more than 11 triangles");
  EXPECT_EQ(refusal(folder_.path("none.stl")), "no such file");
  EXPECT_EQ(refusal("/etc/passwd"), "not one of .stl, .dae, .obj, .gltf, .glb");
}

TEST_F(MeshReader, outlivesAFileThatCrashesAssimp) {
  std::string text = test::cubeDae();
  text.replace(text.find("count=\"24\""), 5, "coUnt");  // a list of unknown length
  EXPECT_EQ(refusal(write("cube.dae", text)).rfind("malformed: ", 0), 0u);
}

/// Bytes flipped, pieces cut out, doubled, exchanged.
std::string bent(std::string text, std::mt19937& random) {
  const auto place = [&] { return random() % text.size(); };
  for (unsigned changes = 1 + random() % 4; changes > 0 && text.size() > 20; --changes) {
    const std::size_t at = place(), length = 1 + random() % 40;
    switch (random() % 4) {
      case 0:
        text[at] ^= static_cast<char>(1u << (random() % 8));
        break;
      case 1:
        text.erase(at, length);
        break;
      case 2:
        text.insert(place(), text.substr(at, length));
        break;
      default:
        text.replace(at, std::min(length, text.size() - at), text.substr(place(), length));
    }
  }
  return text;
}

TEST_F(MeshReader, survivesTamperedFiles) {
  const std::vector<std::pair<std::string, std::string>> kinds = {
      {"a.dae", test::cubeDae()},
      {"b.stl", test::cubeStl()},
      {"c.stl", test::cubeBinaryStl()},
      {"d.obj", test::cubeObj("paint.mtl")},
      {"e.gltf", test::cubeGltf("cube.bin")}};
  write("cube.bin", test::cubeGltfBuffer());
  write("paint.mtl", "newmtl paint\nKd 0 1 0\nd 0.25\n");
  std::mt19937 random(11);
  for (int i = 0; i < 20; ++i) {
    for (const auto& [name, content] : kinds) {
      const std::string why = refusal(write(name, bent(content, random)));
      EXPECT_EQ(why.find('\n'), std::string::npos) << why;
    }
  }
}

/// Files are read when the test lets them.
class HeldMeshes : public ::testing::Test {
 protected:
  HeldMeshes()
      : meshes_({folder_.path("")}, {}, [this](const std::string& path, const std::string&) {
          const int running = ++running_;
          most_running_ = std::max(most_running_.load(), running);
          go_.wait();
          --running_;
          ++read_;
          if (path.find("bad") != std::string::npos) throw std::runtime_error("bent");
          return render::Body();
        }) {
    for (const char* name : {"a.stl", "b.stl", "bad.stl"}) {
      test::writeFile(folder_.path(name), test::cubeStl());
    }
  }
  std::string uri(const std::string& name) const { return "file://" + folder_.path(name); }
  static bool isReady(const std::shared_future<MeshLibrary::Mesh>& mesh) {
    return mesh.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }

  test::TempFolder folder_;
  std::promise<void> may_go_;
  std::shared_future<void> go_ = may_go_.get_future().share();
  std::atomic<int> running_{0}, most_running_{0}, read_{0};
  MeshLibrary meshes_;
};

TEST_F(HeldMeshes, areReadOneAtATimeBesideWhoAsks) {
  const auto a = meshes_.ask(uri("a.stl")), b = meshes_.ask(uri("b.stl"));
  EXPECT_FALSE(isReady(a));
  EXPECT_FALSE(isReady(b));
  EXPECT_EQ(meshes_.ask("").get().reason, "no mesh_resource");
  may_go_.set_value();
  EXPECT_TRUE(a.get().value);
  EXPECT_TRUE(b.get().value);
  EXPECT_EQ(most_running_, 1);
  EXPECT_TRUE(isReady(meshes_.ask(uri("a.stl"))));
  EXPECT_EQ(read_, 2);
}

TEST_F(HeldMeshes, areOneByTheirRealPathAlsoWhenTheyFail) {
  may_go_.set_value();
  std::filesystem::create_symlink(folder_.path("bad.stl"), folder_.path("link.stl"));
  EXPECT_EQ(meshes_.get(uri("bad.stl")).reason, "mesh '" + uri("bad.stl") + "': bent");
  EXPECT_EQ(meshes_.get(uri("./bad.stl")).reason, "mesh '" + uri("./bad.stl") + "': bent");
  EXPECT_EQ(meshes_.get(uri(".//bad.stl")).reason, "mesh '" + uri(".//bad.stl") + "': bent");
  EXPECT_FALSE(meshes_.get(uri("link.stl")).value);
  EXPECT_EQ(read_, 1);
  EXPECT_EQ(*meshes_.get(uri("a.stl")).value, *meshes_.get(uri(".//a.stl")).value);
  EXPECT_EQ(read_, 2);
}

TEST_F(HeldMeshes, refuseMoreThanCanWait) {
  meshes_.ask(uri("b.stl"));
  while (running_ == 0) std::this_thread::yield();  // what is read waits no more
  for (int i = 0; i < 256; ++i) meshes_.ask(uri(std::to_string(i) + ".stl"));
  EXPECT_EQ(meshes_.ask(uri("a.stl")).get().reason, "more than 256 meshes wait to be read");
  may_go_.set_value();
}

TEST(EndableProgram, endsWhatRunsAndStartsNothingMore) {
  EndableProgram program;
  std::thread end([&] { program.end(); });  // before or after the start: both end it
  try {
    EXPECT_EQ(program.run({"sleep", "1000"}).status, 128 + SIGKILL);
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "sleep is not started any more");
  }
  end.join();
  EXPECT_THROW(program.run({"true"}), std::runtime_error);
}

}  // namespace
}  // namespace afterglow::nodes::mesh_reader_test
