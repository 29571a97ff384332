#include "nodes/conversion/mesh_reader.hpp"

#include <csignal>
#include <filesystem>
#include <stdexcept>

#include "nodes/tools/program.hpp"
#include "render/body_bytes.hpp"

namespace afterglow::nodes {
namespace {

constexpr int kKilledBy = 128;  // plus the signal

/// What ended a reader that gave neither triangles nor a reason.
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
