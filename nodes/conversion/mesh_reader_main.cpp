// afterglow_mesh_reader PATH ROOT BYTES TRIANGLES: reads one mesh file (render/mesh_file.hpp) and
// writes its triangles (render/body_bytes.hpp) to standard output; on
// failure exits with status 1 and one line with the reason. A program of its own with bounded
// memory and time, because a malformed file may crash its reader.
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <new>
#include <string>

#include "render/body_bytes.hpp"
#include "render/mesh_file.hpp"

namespace {

constexpr rlim_t kCpuSeconds = 20;  // a million triangles of STL take 5 here
constexpr unsigned kSeconds = 60;
constexpr rlim_t kOutput = rlim_t{256} << 20;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr rlim_t kMemory = RLIM_INFINITY;  // the sanitizers reserve terabytes of addresses
#else
constexpr rlim_t kMemory = rlim_t{1} << 30;
#endif

void bound(int resource, rlim_t most) {
  const rlimit limit{most, most};
  setrlimit(static_cast<decltype(RLIMIT_CPU)>(resource), &limit);
}

void boundAll() {
  bound(RLIMIT_AS, kMemory);
  bound(RLIMIT_CPU, kCpuSeconds);
  bound(RLIMIT_CORE, 0);
  bound(RLIMIT_FSIZE, kOutput);
  alarm(kSeconds);
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // the reader of the output is gone
}

int write(const std::string& text, int status) {
  const bool whole = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  return whole && std::fflush(stdout) == 0 ? status : 2;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace afterglow::render;
  boundAll();
  // Error output of libraries must not get into the output.
  if (std::freopen("/dev/null", "w", stderr) == nullptr) return 2;
  try {
    if (argc != 5) return write("usage: afterglow_mesh_reader PATH ROOT BYTES TRIANGLES", 2);
    const MeshFileLimits limits{std::stoull(argv[3]), std::stoull(argv[4])};
    return write(toBytes(loadMeshFile(argv[1], argv[2], limits)), 0);
  } catch (const std::bad_alloc&) {
    return write("takes more than 1 GiB of memory to read", 1);
  } catch (const std::exception& error) {
    return write(error.what(), 1);
  }
}
