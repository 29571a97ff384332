/// \file
/// Databases that mongodb_log wrote, or the paper's action server, into a store. Built without
/// libmongoc, importing throws StoreError saying so.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "replay/messages/definitions.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

struct RoslogImport {
  std::string name;  ///< name of the behaviors; empty: the database's
  std::vector<std::string> tags;
  /// Only these; empty: all. They also tell which topic a collection without a topic was.
  std::vector<std::string> topics;
  std::optional<Stamp> since;  ///< inclusive
  std::optional<Stamp> until;  ///< exclusive
  /// The silence that ends a behavior and begins another.
  std::optional<std::int64_t> split_gap_ns;
  /// The database keeps no definitions. Empty: those of this machine. Types that are unknown here
  /// are taken from the store, if it has some.
  std::function<std::optional<Definition>(const std::string& type)> definition;
  std::function<void(std::uint64_t done, std::uint64_t total)> progress;
};

struct RoslogImportResult {
  std::vector<Behavior> behaviors;  ///< behaviors by time
  std::uint64_t messages = 0;
  /// Messages and fields that were left out, guessed or filled in, a line each.
  std::vector<std::string> remarks;
};

/// The database of a mongodb:// URI ("roslog" if it names none) as one recording, in the order of
/// inserted_at, then _id, and over it a behavior with outcome "imported", or several. All its
/// writers are read: the loggers in Python and C++, the action server, message_store. The database
/// is not written to; about 64 bytes a message are held meanwhile. One transaction: throws
/// StoreError and leaves the store as it was.
RoslogImportResult importRoslog(const std::string& uri, Store& store,
                                const RoslogImport& import = {});

}  // namespace afterglow::replay
