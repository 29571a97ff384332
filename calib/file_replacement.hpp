/// \file
/// Files that somebody names, and files that are replaced as a whole, several of them together: all
/// or none.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace afterglow::calib {

/// Opens a regular file. The stream has failed for anything else: a pipe would be waited for, a
/// device never ends.
inline std::ifstream openRegularFile(const std::string& path) {
  std::error_code error;
  const bool is_regular = std::filesystem::is_regular_file(path, error);
  return std::ifstream(is_regular ? path : "", std::ios::binary);
}

/// First writes the content to temporary files beside their targets, with fsync; once all are on
/// the disk, renames them in the order they were added. When anything fails, the targets are
/// unchanged, and no temporary file and no folder made for them is left. (A power cut between two
/// renames can still leave new files beside old ones, each of them whole.)
class FileReplacement {
 public:
  FileReplacement() = default;
  /// Undoes everything that was not committed.
  ~FileReplacement();
  FileReplacement(const FileReplacement&) = delete;
  FileReplacement& operator=(const FileReplacement&) = delete;

  /// Makes the folders the path needs; follows a link at the path. Throws std::runtime_error naming
  /// the path and the system's reason.
  void add(const std::string& path, const std::string& content);
  /// Throws std::runtime_error as add does.
  void commit();

 private:
  struct File {
    std::string path;       ///< the target, links followed
    std::string temporary;  ///< empty once renamed
    std::string previous;   ///< a second name of the earlier file; empty if there was none
    bool is_replaced = false;
  };
  void makeFolders(const std::string& folder);
  void takeBack() noexcept;

  std::vector<File> files_;
  std::vector<std::string> folders_made_;
};

/// Replaces one file: readers see either the old or the new content. Throws as FileReplacement
/// does.
void replaceFile(const std::string& path, const std::string& content);

}  // namespace afterglow::calib
