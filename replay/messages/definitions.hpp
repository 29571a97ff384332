/// \file
/// Message definitions found on this machine, for messages that were stored without a definition:
/// the full text and the MD5, as ROS's own tools make them from .msg files. Source of both rules:
/// genmsg (compute_full_text, compute_md5_text).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

struct Definition {
  std::string text;  ///< the definition with those of all contained types
  std::string md5;   ///< 32 hex digits
};

/// MD5 of the type that the full text defines. Throws MessageError if Schema::parse() would.
std::string definitionMd5(const std::string& type, const std::string& text);

/// The parts of an action, each with the definitions of the types that it contains.
struct ActionText {
  std::string goal, result, feedback;
};

/// Folders of packages with messages: PACKAGE/msg/TYPE.msg, or the place that
/// PACKAGE/cmake/PACKAGE-msg-paths.cmake of a catkin devel space names. Earlier folders come first.
class DefinitionFolders {
 public:
  explicit DefinitionFolders(std::vector<std::string> folders) : folders_(std::move(folders)) {}

  /// Empty if there is no such type. Throws MessageError if its definition is malformed, or
  /// contains a type that is not found.
  std::optional<Definition> find(const std::string& type) const;
  /// The text of it alone, which need not be ROS 1's. Contained types that are not found are left
  /// out.
  std::optional<std::string> fullText(const std::string& type) const;
  /// Likewise the texts of PACKAGE/action/TYPE.action of "PACKAGE/TYPE".
  std::optional<ActionText> findAction(const std::string& type) const;

 private:
  std::optional<std::string> text(const std::string& type, const std::string& kind = "msg") const;
  /// The definition with those of all contained types.
  std::string withContained(const std::string& type, const std::string& root) const;

  std::vector<std::string> folders_;
};

/// Finds ROS 1's own definition of a type; empty: it is not known here.
using FindDefinition = std::function<std::optional<Definition>(const std::string& type)>;

/// Replaces a channel's definition that is defective (Schema::parse() refuses it, it has no field
/// at all, or its MD5 is another than the channel's) by the known one of that type and MD5, and
/// fills in an MD5 that is missing. Returns what was wrong; empty: the definition was sound, or
/// none is known that could take its place. Throws MessageError if the MD5 stays unknown.
std::string mendDefinition(Channel& channel, const FindDefinition& find);
/// The remark about it.
std::string mendedText(const Channel& channel, const std::string& why);

/// The folders with ROS 1's definitions on this machine: those that ROS_PACKAGE_PATH and
/// CMAKE_PREFIX_PATH name, the catkin space that this program is in, and /usr/share.
DefinitionFolders installedDefinitions();
/// Those with ROS 2's: what AMENT_PREFIX_PATH names.
DefinitionFolders installedRos2Definitions();

/// Looks into them, once they are asked for; a package that is not whole is not known.
FindDefinition findInstalled();

}  // namespace afterglow::replay
