/// \file
/// The place where recorded light is shown again: its place in the world, or one relative to the
/// robot. Tells which topics are anchored and where their messages name frames; the transforms are
/// the caller's.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "replay/messages/field_edit.hpp"
#include "replay/plan/rewrite.hpp"

namespace afterglow::replay {

enum class Anchor {
  World,  ///< the recorded place, by the recorded tf
  Body    ///< the same frames as they are today
};

struct AnchorSettings {
  std::string frame = "map";  ///< the tf frame that does not move between recording and replay
  Anchor anchor = Anchor::World;
  std::map<TopicName, Anchor> topics;  ///< anchors by recorded name

  /// "world", "body", "/topic=world", "/topic=body". Throws std::invalid_argument, one line.
  void add(const std::string& text);
  /// World only for types that are drawn (clouds, scans, markers, paths, maps and stamped geometry)
  /// and for the topics in `topics`.
  Anchor of(const Channel& channel) const;
};

/// The name in today's tf of a frame's recorded place: "recorded/base_link".
std::string recordedFrame(const std::string& frame);

/// The headers of a type's messages, at any depth.
class HeaderFields {
 public:
  struct Header {
    Stamp stamp;
    std::string frame;  ///< frame without leading slash
    FieldSpan stamp_span, frame_span;
  };

  explicit HeaderFields(const Schema& schema);

  /// Throws MessageError if the bytes do not fit the schema.
  std::vector<Header> find(const Bytes& bytes) const;

 private:
  std::vector<FieldPath> paths_;  ///< stamp, frame, stamp, frame, ...
  FieldFinder finder_;
};

/// Changes a message before its stamps are rewritten. If it throws, the message is not sent.
class MessageAnchor {
 public:
  virtual ~MessageAnchor() = default;
  virtual void anchor(const Channel& channel, Stamp received, const PublishMoment& moment,
                      Bytes& bytes) = 0;
};

}  // namespace afterglow::replay
