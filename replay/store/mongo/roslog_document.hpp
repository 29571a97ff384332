/// \file
/// The facts beside the message in a document of a mongodb_log database; its writers differ.
/// Source: mongodb_store's util.py, util.h, mongodb_log.py, mongodb_log_tf.cpp, message_store. For
/// .cpp files of replay and its tests.
#pragma once

#include <bson/bson.h>

#include <optional>
#include <string>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

struct RoslogFacts {
  /// Logger: mongodb_log in Python, the action server of the paper. CppLogger: of one kind of
  /// message (PointCloud, CompressedImage); it keeps no topic. Afterglow: our own store.
  enum class Writer { Logger, CppLogger, TfLogger, MessageStore, Afterglow };
  Writer writer = Writer::Logger;
  Stamp inserted;     ///< time to the millisecond; the tf logger's to the second
  std::string topic;  ///< absolute; empty if it is not kept
  std::string type;   ///< "package/Type"
  bool latching = false;
  bool was_tf_message = false;  ///< true: its type is gone: `type` has the same fields and MD5
};

/// Empty for a document that does not say what type of message it is or when it came.
std::optional<RoslogFacts> roslogFacts(const bson_t& document);

}  // namespace afterglow::replay
