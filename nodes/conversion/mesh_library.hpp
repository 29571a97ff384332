/// \file
/// Mesh resources of markers: from the name in a message to triangles, each file read once.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "nodes/conversion/converted.hpp"
#include "render/mesh_file.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// Files are read by a program of their own (mesh_reader.hpp): none brings this one down.
/// Keeps what it has read, bounded in number and size, the least recently used going first. Any
/// thread; one file is read at a time, and the others wait.
class MeshLibrary {
 public:
  /// Folders that file:// may name, links followed; none: those of the ROS packages of this
  /// machine. package:// always stays in its package.
  explicit MeshLibrary(std::vector<std::string> roots = {}, render::MeshFileLimits limits = {});

  /// "package://NAME/PATH" or "file:///PATH", without "..". A refusal's reason names the resource;
  /// it stands for some seconds before the file is looked at again. A file that was read is not.
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

}  // namespace afterglow::nodes
