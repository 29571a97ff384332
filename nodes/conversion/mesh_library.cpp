#include "nodes/conversion/mesh_library.hpp"

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <utility>

#include "nodes/conversion/resource_file.hpp"
#include "render/body_bytes.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;
using MaybeMesh = Converted<render::SharedBody>;

constexpr std::size_t kMostEntries = 256, kMostRequests = 256;
constexpr std::size_t kMostNames = 4096;  // spellings of them
constexpr std::size_t kMostTriangles = 4'000'000;  // kept, all together
constexpr std::chrono::seconds kRetry(5);
constexpr int kRetryShare = 20;  // a file that took long to fail is tried again later

constexpr int kKilledBy = 128;  // plus the signal

std::shared_future<MaybeMesh> ready(MaybeMesh mesh) {
  std::promise<MaybeMesh> promise;
  promise.set_value(std::move(mesh));
  return promise.get_future().share();
}

/// Returns what is known of a file, as the answer to a request by this name.
MaybeMesh answer(const std::string& resource, MaybeMesh mesh) {
  if (!mesh.value) mesh.reason = "mesh '" + printable(resource) + "': " + mesh.reason;
  return mesh;
}

std::string realPath(const std::string& path) {
  std::error_code error;
  const fs::path real = fs::weakly_canonical(path, error);
  return error ? path : real.string();
}

/// The reason if the reader gave neither triangles nor a reason.
const char* endOf(int status) {
  switch (status - kKilledBy) {
    case SIGXCPU:
    case SIGKILL:  // the kernel's, a second after SIGXCPU
    case SIGALRM:
      return "takes too long to read";
    default:
      return "malformed: its reader crashed";
  }
}

}  // namespace

MeshLibrary::MeshLibrary(std::vector<std::string> roots, render::MeshFileLimits limits, Read read)
    : roots_(std::move(roots)),
      roots_are_packages_(roots_.empty()),
      read_(std::move(read)),
      thread_(kMostRequests) {
  if (read_) return;
  read_ = [this, limits](const std::string& path, const std::string& root) {
    return readMeshFile(program_, path, root, limits);
  };
}

MeshLibrary::~MeshLibrary() { program_.end(); }

std::shared_future<MaybeMesh> MeshLibrary::ask(const std::string& resource) {
  if (resource.empty()) return ready(refused<render::SharedBody>("no mesh_resource"));
  if (resource.size() > kLongestResource) {
    return ready(refused<render::SharedBody>("mesh_resource is longer than 1024 characters"));
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto name = names_.find(resource);
  const Entry* entry = name == names_.end() ? nullptr : known(name->second);
  if (entry != nullptr) {
    entries_.find(name->second)->second.used = ++uses_;
    return ready(answer(resource, entry->mesh));
  }
  const auto asked = asked_.find(resource);
  if (asked != asked_.end()) return asked->second;
  const auto promise = std::make_shared<std::promise<Mesh>>();
  const auto future = promise->get_future().share();
  const bool is_posted = thread_.post([this, resource, promise] {
    MaybeMesh mesh = answer(resource, read(resource));
    {
      const std::lock_guard<std::mutex> answered(mutex_);
      asked_.erase(resource);
    }
    promise->set_value(std::move(mesh));
  });
  if (!is_posted) {
    return ready(refused<render::SharedBody>("more than 256 meshes wait to be read"));
  }
  asked_.emplace(resource, future);
  return future;
}

/// Empty if nothing is known, or a failure is so old that the file is worth another try.
const MeshLibrary::Entry* MeshLibrary::known(const Key& key) const {
  const auto found = entries_.find(key);
  if (found == entries_.end()) return nullptr;
  const bool is_old =
      !found->second.mesh.value && std::chrono::steady_clock::now() > found->second.retry_at;
  return is_old ? nullptr : &found->second;
}

MaybeMesh MeshLibrary::read(const std::string& resource) {
  const Converted<Place> place = find(resource);
  const Key key = place.value ? Key(realPath(place.value->path), realPath(place.value->root))
                              : Key(resource, "");
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (names_.size() >= kMostNames) names_.clear();
    names_[resource] = key;
    if (const Entry* entry = known(key)) return entry->mesh;
  }
  const auto begin = std::chrono::steady_clock::now();
  MaybeMesh mesh =
      place.value ? load(*place.value) : refused<render::SharedBody>(place.reason);
  const auto end = std::chrono::steady_clock::now();
  const auto retry_at = end + kRetry + kRetryShare * (end - begin);
  const std::lock_guard<std::mutex> lock(mutex_);
  entries_.insert_or_assign(key, Entry{mesh, retry_at, ++uses_});
  makeRoom();
  return mesh;
}

MaybeMesh MeshLibrary::load(const Place& place) {
  try {
    return {std::make_shared<const render::Body>(read_(place.path, place.root)), {}};
  } catch (const std::exception& error) {  // also std::bad_alloc, which the file causes
    return refused<render::SharedBody>(error.what());
  }
}

Converted<MeshLibrary::Place> MeshLibrary::find(const std::string& resource) {
  ResourceFile named;
  try {
    named = resourceFile(resource);
  } catch (const std::runtime_error& error) {
    return refused<Place>(error.what());
  }
  if (!named.package.empty()) return {Place{named.path, named.package}, {}};
  if (roots_are_packages_ && roots_.empty()) roots_ = packageFolders();
  const auto root = std::find_if(roots_.begin(), roots_.end(), [&](const std::string& folder) {
    return isInside(named.path, folder);
  });
  if (root == roots_.end()) {
    return refused<Place>("outside the folders meshes may come from (mesh_roots)");
  }
  return {Place{named.path, *root}, {}};
}

/// Drawables keep the meshes that they show.
void MeshLibrary::makeRoom() {
  const auto size = [](const Entry& entry) {
    return entry.mesh.value ? (*entry.mesh.value)->triangles.size() : 0;
  };
  std::size_t triangles = 0;
  for (const auto& [name, entry] : entries_) triangles += size(entry);
  while (entries_.size() > 1 && (entries_.size() > kMostEntries || triangles > kMostTriangles)) {
    const auto oldest = std::min_element(
        entries_.begin(), entries_.end(),
        [](const auto& a, const auto& b) { return a.second.used < b.second.used; });
    triangles -= size(oldest->second);
    entries_.erase(oldest);
  }
}

render::Body readMeshFile(const std::string& path, const std::string& root,
                          const render::MeshFileLimits& limits) {
  EndableProgram program;
  return readMeshFile(program, path, root, limits);
}

render::Body readMeshFile(EndableProgram& program, const std::string& path,
                          const std::string& root, const render::MeshFileLimits& limits) {
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe");
  const std::string reader = own.parent_path() / "afterglow_mesh_reader";
  const ProgramResult result = program.run(
      {reader, path, root, std::to_string(limits.bytes), std::to_string(limits.triangles)});
  const bool has_reason = result.status == 1 && !result.output.empty();
  if (has_reason) throw std::runtime_error(result.output);
  if (result.status != 0) throw std::runtime_error(endOf(result.status));
  return render::bodyFromBytes(result.output);
}

}  // namespace afterglow::nodes
