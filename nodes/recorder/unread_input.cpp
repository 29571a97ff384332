#include "nodes/recorder/unread_input.hpp"

#include <sys/ioctl.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>

namespace afterglow::nodes {

bool hasUnreadInput() {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", error)) {
    const int fd = std::atoi(entry.path().filename().c_str());
    struct stat kind {};
    int unread = 0;
    if (fstat(fd, &kind) == 0 && S_ISSOCK(kind.st_mode) && ioctl(fd, FIONREAD, &unread) == 0 &&
        unread > 0) {
      return true;
    }
  }
  return false;
}

}  // namespace afterglow::nodes
