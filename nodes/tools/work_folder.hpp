/// \file
/// Room beside a file that is being made, for what it is made of.
#pragma once

#include <string>

namespace afterglow::nodes {

/// A new folder that only its owner can read, gone with the object.
class WorkFolder {
 public:
  /// Beside `file`; throws std::runtime_error naming the folder if it cannot be made.
  explicit WorkFolder(const std::string& file);
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  ~WorkFolder();

  std::string path(const std::string& name) const;
  /// A new folder in it.
  std::string folder(const std::string& name) const;

 private:
  std::string path_;
};

}  // namespace afterglow::nodes
