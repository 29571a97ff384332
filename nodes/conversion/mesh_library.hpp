/// \file
/// Mesh resources of markers: from the name in a message to triangles. Each file is read once, by a
/// program of its own (mesh_reader_main.cpp): a file that crashes assimp must not end the
/// projection, and one that takes long must not stop it.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/tools/program.hpp"
#include "render/mesh_file.hpp"
#include "render/scene/scene.hpp"
#include "replay/clock/worker_thread.hpp"

namespace afterglow::nodes {

/// Keeps the meshes that it has read, bounded in number and size; drops the least recently used
/// first. Files are read one at a time in a thread of its own, and remembered, also as failures,
/// by their real path: other spellings are not read again. Any thread.
class MeshLibrary {
 public:
  using Mesh = Converted<render::SharedBody>;
  /// The file and the folder that it may name others in. Throws std::exception.
  using Read = std::function<render::Body(const std::string& path, const std::string& root)>;

  /// `roots`: folders that file:// may name, links followed; empty: those of the ROS packages of
  /// this machine. package:// always stays in its package. `read`: instead of readMeshFile.
  explicit MeshLibrary(std::vector<std::string> roots = {}, render::MeshFileLimits limits = {},
                       Read read = {});
  /// Ends a reading; what has been asked for and not been read is never answered, or refused.
  ~MeshLibrary();

  /// "package://NAME/PATH" or "file:///PATH", without "..". A refusal's reason names the resource;
  /// it stands for some seconds, longer after a long reading, before the file is tried again. A
  /// file is read successfully only once.
  std::shared_future<Mesh> ask(const std::string& resource);
  /// Waits for the answer: a minute, if no other meshes are asked for.
  Mesh get(const std::string& resource) { return ask(resource).get(); }

 private:
  using Key = std::pair<std::string, std::string>;  ///< real path and root; or the resource and ""
  struct Entry {
    Mesh mesh;
    std::chrono::steady_clock::time_point retry_at;
    std::uint64_t used = 0;
  };
  struct Place {
    std::string path, root;
  };

  Mesh read(const std::string& resource);
  Mesh load(const Place& place);
  const Entry* known(const Key& key) const;
  Converted<Place> find(const std::string& resource);
  void makeRoom();

  std::vector<std::string> roots_;  ///< folders, and what follows, for the reading thread alone
  bool roots_are_packages_;
  EndableProgram program_;
  Read read_;
  std::mutex mutex_;  ///< guards what follows
  std::map<std::string, Key> names_;
  std::map<Key, Entry> entries_;
  std::uint64_t uses_ = 0;
  std::map<std::string, std::shared_future<Mesh>> asked_;
  replay::TaskThread thread_;  ///< last: its tasks use all of the above
};

/// Does what render::loadMeshFile does in a program of its own. Starts afterglow_mesh_reader, which
/// lies beside the running program, and waits for it: a minute at most. Throws std::runtime_error
/// also where the file crashes it, takes it too much time or memory, or where it cannot be started.
/// Safe from several threads.
render::Body readMeshFile(const std::string& path, const std::string& root,
                          const render::MeshFileLimits& limits = {});
/// Reads by a program that another thread can end.
render::Body readMeshFile(EndableProgram& program, const std::string& path,
                          const std::string& root, const render::MeshFileLimits& limits = {});

}  // namespace afterglow::nodes
