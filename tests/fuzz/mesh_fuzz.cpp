// Mesh files that a marker names. An input is the letter of a kind of file, and the file.
#include <unistd.h>

#include <fstream>
#include <map>
#include <stdexcept>
#include <string>

#include "render/mesh_file.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::fuzz::mesh_fuzz {

AFTERGLOW_FUZZ_TARGET(mesh) {
  static const std::map<char, std::string> kinds = {
      {'s', ".stl"}, {'d', ".dae"}, {'o', ".obj"}, {'g', ".gltf"}, {'b', ".glb"}};
  static const test::TempFolder folder;
  if (size == 0) return;
  const auto kind = kinds.find(static_cast<char>(data[0]));
  if (kind == kinds.end()) return;
  const std::string path = folder.path("mesh" + kind->second);
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(data) + 1, static_cast<std::streamsize>(size - 1));
  try {
    render::loadMeshFile(path, folder.path(""), {1 << 20, 100000});
  } catch (const std::runtime_error&) {
    // The right answer to most inputs.
  }
}

}  // namespace afterglow::fuzz::mesh_fuzz
