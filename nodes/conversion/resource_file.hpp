/// \file
/// Files of this machine that messages and robot descriptions name.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace afterglow::nodes {

constexpr std::size_t kLongestResource = 1024;

/// The destination of "package://NAME/PATH" or "file:///PATH", before links are followed.
struct ResourceFile {
  std::string path;
  std::string package;  ///< the folder of its package; empty: file://
};

/// Throws std::runtime_error saying why there is no such file: another scheme, no ROS package of
/// that name, "..", a NUL, more than kLongestResource letters. Whether the file is there, and where
/// links in its path lead, is not looked at.
ResourceFile resourceFile(const std::string& uri);

/// Returns true if a path leads into a folder when all links are followed.
bool isInside(const std::filesystem::path& path, const std::filesystem::path& folder);

/// The folders of all ROS packages of this machine.
std::vector<std::string> packageFolders();

}  // namespace afterglow::nodes
