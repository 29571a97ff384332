/// \file
/// Files that messages refer to without bringing them along: sounds to play, meshes to draw.
/// Sources: sound_play/SoundRequest (PLAY_FILE; arg2 is the package that arg lies in),
/// visualization_msgs/Marker (mesh_resource).
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "replay/messages/field_edit.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::replay {

/// Finds files in the messages of one type; looks wherever in it a Marker or a SoundRequest is
/// contained.
class FileReferences {
 public:
  explicit FileReferences(const Schema& schema);

  /// Returns true if messages of the type can refer to files at all.
  bool any() const { return finder_ != nullptr; }
  /// "package://NAME/PATH", "file:///PATH", or whatever else the message says. Bytes that do not
  /// fit the type refer to nothing.
  std::vector<std::string> find(const Bytes& bytes) const;
  /// Refers to `other(uri)` instead, a file:// URI, or as before where that is empty. Throws
  /// MessageError if the bytes do not fit the type.
  void replace(Bytes& bytes, const std::function<std::string(const std::string& uri)>& other) const;

 private:
  /// Calls on_file(uri, its place, the place of its package or null).
  void visit(const Bytes& bytes,
             const std::function<void(const std::string&, const FieldSpan&, const FieldSpan*)>&
                 on_file) const;

  std::unique_ptr<FieldFinder> finder_;
  std::size_t meshes_ = 0, sounds_ = 0;  ///< number of places of each kind; meshes come first
};

}  // namespace afterglow::replay
