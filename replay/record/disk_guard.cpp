#include "replay/record/disk_guard.hpp"

#include <sys/statvfs.h>

#include <filesystem>

namespace afterglow::replay {

std::optional<std::uint64_t> freeBytes(const std::string& folder) {
  std::error_code error;
  std::filesystem::path existing = std::filesystem::absolute(folder, error);
  while (!std::filesystem::exists(existing, error) && existing.has_relative_path()) {
    existing = existing.parent_path();
  }
  struct statvfs disk {};
  if (statvfs(existing.c_str(), &disk) != 0) return std::nullopt;
  return std::uint64_t{disk.f_bavail} * disk.f_frsize;
}

DiskState judgeDisk(const std::string& folder, std::uint64_t free, std::uint64_t min_space) {
  if (min_space == 0 || free / 5 >= min_space) return {};
  const auto megabytes = [](std::uint64_t bytes) { return std::to_string(bytes >> 20) + " MiB"; };
  const std::string text = "only " + megabytes(free) + " are free below " + folder;
  if (free < min_space) {
    return {DiskState::Level::Full,
            text + ", less than the " + megabytes(min_space) + " that recording wants"};
  }
  return {DiskState::Level::Low, text + ", and below " + megabytes(min_space) + " recording ends"};
}

}  // namespace afterglow::replay
