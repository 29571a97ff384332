/// \file
/// Where recorded light belongs when it is shown again: on the spot of the world where it was, or
/// with the body. Says which topics are meant and where their messages name frames; the transforms
/// themselves are the caller's.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "replay/messages/field_edit.hpp"
#include "replay/plan/rewrite.hpp"

namespace afterglow::replay {

enum class Anchor {
  World,  ///< where it was then, by the recorded tf
  Body    ///< its frames as they are today
};

struct AnchorSettings {
  std::string frame = "map";  ///< what stays where it is from one day to the next
  Anchor anchor = Anchor::World;
  std::map<std::string, Anchor> topics;  ///< by recorded name

  /// "world", "body", "/topic=world", "/topic=body". Throws std::invalid_argument, one line.
  void add(const std::string& text);
  /// World only for what is drawn (clouds, scans, markers, paths, maps and stamped geometry), and
  /// what `topics` names.
  Anchor of(const Channel& channel) const;
};

/// "recorded/base_link": where a frame was, in today's tf. Without a leading slash.
std::string recordedFrame(const std::string& frame);

/// The headers of a type's messages, at any depth.
class HeaderFields {
 public:
  struct Header {
    Stamp stamp;
    std::string frame;  ///< without leading slash
    FieldSpan stamp_span, frame_span;
  };

  explicit HeaderFields(const Schema& schema);

  /// Throws MessageError if the bytes do not fit the schema.
  std::vector<Header> find(const Bytes& bytes) const;

 private:
  std::vector<FieldPath> paths_;  ///< stamp, frame, stamp, frame, ...
  FieldFinder finder_;
};

/// Has a say in a message before it is rewritten to now. May throw: the message is not sent then.
class MessageAnchor {
 public:
  virtual ~MessageAnchor() = default;
  virtual void anchor(const Channel& channel, Stamp received, const PublishMoment& moment,
                      Bytes& bytes) = 0;
};

}  // namespace afterglow::replay
