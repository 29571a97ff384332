#include "nodes/conversion/mesh_library.hpp"

#include <ros/package.h>

#include <algorithm>
#include <cctype>
#include <csignal>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/tools/program.hpp"
#include "render/body_bytes.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;
using MaybeMesh = Converted<render::SharedBody>;

const std::string kPackage = "package://", kFile = "file://";
constexpr std::size_t kLongestResource = 1024;
constexpr std::size_t kMostEntries = 256;
constexpr std::size_t kMostTriangles = 4'000'000;  // kept, all together
constexpr std::chrono::seconds kRetry(5);
constexpr int kRetryShare = 20;  // a file that took long to fail is tried again later

bool begins(const std::string& text, const std::string& with) {
  return text.compare(0, with.size(), with) == 0;
}

bool climbs(const std::string& path) {
  const fs::path parsed(path);
  return std::find(parsed.begin(), parsed.end(), "..") != parsed.end();
}

bool isInside(const fs::path& path, const fs::path& root) {
  std::error_code error;
  const fs::path real = fs::weakly_canonical(path, error), real_root = fs::canonical(root, error);
  return !error &&
         std::mismatch(real_root.begin(), real_root.end(), real.begin(), real.end()).first ==
             real_root.end();
}

std::vector<std::string> packageFolders() {
  std::vector<std::string> names, folders;
  ros::package::getAll(names);
  for (const std::string& name : names) folders.push_back(ros::package::getPath(name));
  folders.erase(std::remove(folders.begin(), folders.end(), ""), folders.end());
  return folders;
}

constexpr int kKilledBy = 128;  // plus the signal

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

MeshLibrary::MeshLibrary(std::vector<std::string> roots, render::MeshFileLimits limits)
    : roots_(std::move(roots)), limits_(limits), roots_are_packages_(roots_.empty()) {}

MaybeMesh MeshLibrary::get(const std::string& resource) {
  if (resource.empty()) return refused<render::SharedBody>("no mesh_resource");
  if (resource.size() > kLongestResource) {
    return refused<render::SharedBody>("mesh_resource is longer than 1024 characters");
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  auto found = entries_.find(resource);
  if (found == entries_.end() || (!found->second.mesh.value && now > found->second.retry_at)) {
    MaybeMesh mesh = load(resource);
    if (!mesh.value) mesh.reason = "mesh '" + printable(resource) + "': " + mesh.reason;
    const auto end = std::chrono::steady_clock::now();
    const auto retry_at = end + kRetry + kRetryShare * (end - now);
    found = entries_.insert_or_assign(resource, Entry{std::move(mesh), retry_at, 0}).first;
  }
  found->second.used = ++uses_;
  const MaybeMesh mesh = found->second.mesh;
  makeRoom();
  return mesh;
}

MaybeMesh MeshLibrary::load(const std::string& resource) {
  const Converted<Place> place = find(resource);
  if (!place.value) return refused<render::SharedBody>(place.reason);
  try {
    return {std::make_shared<const render::Body>(
                readMeshFile(place.value->path, place.value->root, limits_)),
            {}};
  } catch (const std::exception& error) {  // also std::bad_alloc, which the file causes
    return refused<render::SharedBody>(error.what());
  }
}

Converted<MeshLibrary::Place> MeshLibrary::find(const std::string& resource) {
  if (resource.find('\0') != std::string::npos) return refused<Place>("a NUL in its name");
  if (climbs(resource)) return refused<Place>("'..' is not followed");
  if (begins(resource, kPackage)) return findInPackage(resource.substr(kPackage.size()));
  if (begins(resource, kFile)) return findFile(resource.substr(kFile.size()));
  return refused<Place>("neither package:// nor file://");
}

Converted<MeshLibrary::Place> MeshLibrary::findInPackage(const std::string& name_and_path) {
  const std::size_t slash = name_and_path.find('/');
  const std::string name = name_and_path.substr(0, slash);
  const bool named = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-';
  });
  if (!named || slash == std::string::npos) return refused<Place>("not package://NAME/PATH");
  const std::string folder = ros::package::getPath(name);
  if (folder.empty()) return refused<Place>("there is no ROS package of that name");
  return {Place{folder + name_and_path.substr(slash), folder}, {}};
}

Converted<MeshLibrary::Place> MeshLibrary::findFile(const std::string& path) {
  if (path.empty() || path.front() != '/') return refused<Place>("not file:///PATH");
  if (roots_are_packages_ && roots_.empty()) roots_ = packageFolders();
  const auto root = std::find_if(roots_.begin(), roots_.end(),
                                 [&](const std::string& folder) { return isInside(path, folder); });
  if (root == roots_.end()) {
    return refused<Place>("outside the folders meshes may come from (mesh_roots)");
  }
  return {Place{path, *root}, {}};
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
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe");
  const std::string reader = own.parent_path() / "afterglow_mesh_reader";
  const ProgramResult result = runProgram(
      {reader, path, root, std::to_string(limits.bytes), std::to_string(limits.triangles)});
  if (result.status == 1) throw std::runtime_error(result.output);
  if (result.status != 0) throw std::runtime_error(endOf(result.status));
  return render::bodyFromBytes(result.output);
}

}  // namespace afterglow::nodes
