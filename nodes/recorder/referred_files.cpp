#include "nodes/recorder/referred_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <stdexcept>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/conversion/resource_file.hpp"
#include "replay/messages/text.hpp"
#include "replay/store/checksum.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;

const std::string kSounds = "/usr/share/sounds";
constexpr std::uintmax_t kLargest = 20u << 20;

bool isSoundOrMesh(const fs::path& path) {
  static const std::set<std::string> kKnown = {".wav",  ".ogg", ".oga",  ".mp3", ".flac",
                                               ".aiff", ".stl", ".stlb", ".dae", ".mesh",
                                               ".obj",  ".ply", ".glb",  ".gltf"};
  return kKnown.count(replay::lowerCase(path.extension())) != 0;
}

/// An open file, closed with the object.
class OpenFile {
 public:
  /// Nothing is created, and no pipe or device waited for.
  explicit OpenFile(const fs::path& path)
      : file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY)) {
    struct stat about {};
    if (file_ < 0 || fstat(file_, &about) != 0 || !S_ISREG(about.st_mode)) {
      close();
      throw std::runtime_error("there is no such file");
    }
    size_ = static_cast<std::uintmax_t>(about.st_size);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() { close(); }

  std::uintmax_t size() const { return size_; }
  /// Returns the path of the open file, whatever its name leads to by now.
  fs::path realPath() const {
    return fs::read_symlink("/proc/self/fd/" + std::to_string(file_));
  }
  replay::Bytes contents() const {
    replay::Bytes bytes(static_cast<std::size_t>(size_));
    std::size_t have = 0;
    while (have < bytes.size()) {
      const auto read = ::read(file_, bytes.data() + have, bytes.size() - have);
      if (read <= 0) throw std::runtime_error("it cannot be read");
      have += static_cast<std::size_t>(read);
    }
    return bytes;
  }

 private:
  void close() {
    if (file_ >= 0) ::close(file_);
  }
  int file_;
  std::uintmax_t size_ = 0;
};

replay::Bytes contentsOf(const std::string& uri, const std::vector<std::string>& roots) {
  const ResourceFile named = resourceFile(uri);
  if (!isSoundOrMesh(named.path)) throw std::runtime_error("no sound and no mesh by its name");
  const OpenFile file(named.path);
  const fs::path real = file.realPath();
  if (!isSoundOrMesh(real)) throw std::runtime_error("a link to what is no sound and no mesh");
  if (!named.package.empty() && !isInside(real, named.package)) {
    throw std::runtime_error("it leads out of its package");
  }
  const auto isIn = [&](const std::vector<std::string>& folders) {
    return std::any_of(folders.begin(), folders.end(),
                       [&](const std::string& folder) { return isInside(real, folder); });
  };
  if (named.package.empty() && !isIn({kSounds}) && !isIn(roots) && !isIn(packageFolders())) {
    throw std::runtime_error("outside the folders that files may come from (~file_roots)");
  }
  if (file.size() > kLargest) throw std::runtime_error("larger than 20 MiB");
  return file.contents();
}

}  // namespace

std::map<std::string, std::string> keepFiles(replay::Store& store,
                                             const std::set<std::string>& uris,
                                             const std::vector<std::string>& roots,
                                             std::vector<std::string>& remarks) {
  std::map<std::string, std::string> kept;
  for (const std::string& uri : uris) {
    replay::Bytes contents;
    try {
      contents = contentsOf(uri, roots);
    } catch (const std::runtime_error& error) {
      remarks.push_back("the file '" + printable(uri.substr(0, kLongestResource)) +
                        "' was not kept: " + error.what());
      continue;
    }
    const std::string hash = replay::sha256(contents);
    store.addFile(hash, contents);
    kept[uri] = hash;
  }
  return kept;
}

bool isHere(const std::string& uri) {
  try {
    std::error_code error;
    return fs::is_regular_file(resourceFile(uri).path, error);
  } catch (const std::runtime_error&) {
    return false;
  }
}

}  // namespace afterglow::nodes
