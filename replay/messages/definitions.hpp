/// \file
/// Message definitions found on this machine, for messages that were stored without a definition:
/// the full text and the MD5, as ROS's own tools make them from .msg files. Source of both rules:
/// genmsg (compute_full_text, compute_md5_text).
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace afterglow::replay {

struct Definition {
  std::string text;  ///< with the definitions of all contained types
  std::string md5;   ///< 32 hex digits
};

/// MD5 of the type that the full text defines. Throws MessageError if Schema::parse() would.
std::string definitionMd5(const std::string& type, const std::string& text);

/// Folders of packages with messages: PACKAGE/msg/TYPE.msg, or the place that
/// PACKAGE/cmake/PACKAGE-msg-paths.cmake of a catkin devel space names. Earlier folders come first.
class DefinitionFolders {
 public:
  explicit DefinitionFolders(std::vector<std::string> folders) : folders_(std::move(folders)) {}

  /// Empty if there is no such type. Throws MessageError if its definition is malformed, or
  /// contains a type that is not found.
  std::optional<Definition> find(const std::string& type) const;

 private:
  std::optional<std::string> text(const std::string& type) const;

  std::vector<std::string> folders_;
};

/// The folders with definitions on this machine: those that ROS_PACKAGE_PATH, CMAKE_PREFIX_PATH and
/// AMENT_PREFIX_PATH name, the catkin space that this program is in, and /usr/share.
DefinitionFolders installedDefinitions();

}  // namespace afterglow::replay
