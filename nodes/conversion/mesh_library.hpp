/// \file
/// Mesh resources of markers: from the name in a message to triangles. Each file is read once, by a
/// program of its own (mesh_reader_main.cpp): a file that crashes assimp must not end the
/// projection.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "nodes/conversion/geometry_conversion.hpp"
#include "render/mesh_file.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// Keeps the meshes that it has read, bounded in number and size; drops the least recently used
/// first. Any thread; one file is read at a time.
class MeshLibrary {
 public:
  /// `roots`: folders that file:// may name, links followed; empty: those of the ROS packages of
  /// this machine. package:// always stays in its package.
  explicit MeshLibrary(std::vector<std::string> roots = {}, render::MeshFileLimits limits = {});

  /// "package://NAME/PATH" or "file:///PATH", without "..". A refusal's reason names the resource;
  /// it stands for some seconds before the file is tried again. A file is read successfully only
  /// once.
  Converted<render::SharedBody> get(const std::string& resource);

 private:
  struct Entry {
    Converted<render::SharedBody> mesh;
    std::chrono::steady_clock::time_point retry_at;
    std::uint64_t used = 0;
  };
  struct Place {
    std::string path, root;
  };

  Converted<render::SharedBody> load(const std::string& resource);
  Converted<Place> find(const std::string& resource);
  Converted<Place> findInPackage(const std::string& name_and_path);
  Converted<Place> findFile(const std::string& path);
  void makeRoom();

  std::vector<std::string> roots_;
  render::MeshFileLimits limits_;
  bool roots_are_packages_;
  std::mutex mutex_;
  std::map<std::string, Entry> entries_;
  std::uint64_t uses_ = 0;
};

/// As render::loadMeshFile. Starts afterglow_mesh_reader, which lies beside the running program,
/// and waits for it: a minute at most. Throws std::runtime_error also where the file crashes it,
/// takes it too much time or memory, or where it cannot be started. Safe from several threads.
render::Body readMeshFile(const std::string& path, const std::string& root,
                          const render::MeshFileLimits& limits = {});

}  // namespace afterglow::nodes
