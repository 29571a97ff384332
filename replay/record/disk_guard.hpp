/// \file
/// The watch over the disk's room for recordings.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace afterglow::replay {

/// Bytes that may still be written below this folder, or where it will be made. Empty if the
/// system does not say.
std::optional<std::uint64_t> freeBytes(const std::string& folder);

/// The state of the disk, by rosbag's --min-space: warns below five times the minimum, ends
/// recordings below it.
struct DiskState {
  enum class Level { Ample, Low, Full } level = Level::Ample;
  std::string text;  ///< a line; empty for Ample
};
DiskState judgeDisk(const std::string& folder, std::uint64_t free, std::uint64_t min_space);

}  // namespace afterglow::replay
