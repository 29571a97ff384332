#include "replay/bags/export_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "replay/bags/bag_file.hpp"

namespace afterglow::replay {

ExportFile::ExportFile(const std::string& path)
    : path_(path), partial_(path + ".part" + std::to_string(getpid())) {}

ExportFile::~ExportFile() {
  if (is_published_) return;
  std::error_code ignored;
  std::filesystem::remove(partial_, ignored);
}

void ExportFile::sync() const {
  const int descriptor = ::open(partial_.c_str(), O_RDONLY | O_CLOEXEC);
  const bool is_synced = descriptor >= 0 && ::fsync(descriptor) == 0;
  const std::string reason = std::strerror(errno);
  if (descriptor >= 0) ::close(descriptor);
  if (!is_synced) throw BagError(path_ + ": cannot write the bag: " + reason);
}

void ExportFile::publish() {
  std::error_code error;
  std::filesystem::rename(partial_, path_, error);
  if (error) throw BagError(path_ + ": cannot write the file: " + error.message());
  is_published_ = true;
}

}  // namespace afterglow::replay
