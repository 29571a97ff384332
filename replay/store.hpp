/// \file
/// The store: one message log and, over it, behaviors as intervals. The log is divided into
/// recordings (a run of a recorder, an imported bag), so that two recordings of the same minute
/// never mix. A message is stored once, however many behaviors cover it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "replay/message.hpp"

namespace afterglow::replay {

/// The store cannot be opened, read or written; the text names the store, what was tried and why.
class StoreError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One execution of one behavior.
struct Behavior {
  std::int64_t id = 0;         ///< given by the store
  std::int64_t recording = 0;  ///< the part of the log it lies in
  std::string name;
  std::string tree_path;       ///< its place in the behavior tree, e.g. "kitting/pick"; may be empty
  std::int64_t parent = 0;     ///< enclosing behavior; 0: none
  int attempt = 1;
  std::string outcome;         ///< "success", "failure", "stopped", ...; empty while it runs
  Stamp begin;                 ///< inclusive
  std::optional<Stamp> end;    ///< exclusive; empty: still running, or its recorder died
  std::string robot;
  std::string parameters = "{}";   ///< JSON object
  std::vector<std::string> tags;
  std::string calibration = "{}";  ///< JSON object: the projector's calibration in use
  std::vector<std::string> topics; ///< the topics that belong to it, heard or not
};

/// Which behaviors; unset members match everything. A behavior without an end is taken to reach to
/// its recording's last message.
struct BehaviorFilter {
  std::optional<std::string> name;
  std::optional<std::string> outcome;
  std::optional<std::string> topic;  ///< its own, with at least one message
  std::optional<Stamp> since;        ///< end after this
  std::optional<Stamp> until;        ///< begin before this
};

/// How much a behavior holds on one topic (of one type).
struct TopicSummary {
  std::string topic;
  std::string type;
  std::uint64_t count = 0;
  Stamp first, last;  ///< of the first and the last message
};

/// Which of the messages of a behavior's recording in a behavior's interval. Without an end it
/// reaches to the recording's last message.
struct MessageRange {
  /// Empty: the behavior's own. Others of the recording may be named: its context (/tf, ...).
  std::vector<std::string> topics;
  std::optional<Stamp> begin;       ///< inclusive
  std::optional<Stamp> end;         ///< exclusive
};

/// Forward reader in total order: receive stamp, then sequence. Reads ahead with bounded memory;
/// valid while its store lives. Throws StoreError when reading fails.
class MessageCursor {
 public:
  virtual ~MessageCursor() = default;
  virtual std::optional<Message> next() = 0;  ///< empty at the end
};

/// Every method throws StoreError on failure and may be called from any thread.
class Store {
 public:
  virtual ~Store() = default;

  // ---------------------------------------------------------------------------------- writing
  /// A new part of the log; `source` says where it comes from (recorder's node name, bag's path).
  virtual std::int64_t addRecording(const std::string& source) = 0;
  /// Id of this channel in this recording, stored on first sight; definitions are stored once.
  virtual std::int64_t addChannel(std::int64_t recording, const Channel& channel) = 0;
  /// All or none of these messages, in one transaction. Decoded documents are made here. A message
  /// whose sequence and stamp its channel has already is refused.
  virtual void append(const std::vector<Message>& messages) = 0;
  /// Stores a behavior (its id is ignored) and returns the new id.
  virtual std::int64_t addBehavior(const Behavior& behavior) = 0;
  virtual void endBehavior(std::int64_t id, Stamp end, const std::string& outcome) = 0;
  /// Runs `work`, whose writes to this store are kept as a whole when it returns and dropped as a
  /// whole when it throws; the exception goes on. Other threads and processes wait to write, and
  /// read what was there before.
  virtual void transaction(const std::function<void()>& work) = 0;

  // ---------------------------------------------------------------------------------- reading
  /// Newest first (by begin, then id).
  virtual std::vector<Behavior> behaviors(const BehaviorFilter& filter) const = 0;
  virtual std::optional<Behavior> behavior(std::int64_t id) const = 0;
  /// What was heard on its own topics, by topic, then type.
  virtual std::vector<TopicSummary> topics(const Behavior& behavior) const = 0;
  /// What its recording holds on other topics in its interval.
  virtual std::vector<TopicSummary> contextTopics(const Behavior& behavior) const = 0;
  virtual Channel channel(std::int64_t id) const = 0;
  virtual std::unique_ptr<MessageCursor> messages(const Behavior& behavior,
                                                  const MessageRange& range) const = 0;
};

/// Whether openStore may make what is not there.
enum class OpenMode { ReadOnly, ReadWrite };

/// "sqlite:PATH" or a plain path; empty: $AFTERGLOW_STORE, else ~/.local/share/afterglow/afterglow.db.
/// ReadWrite creates file and folders; ReadOnly demands an existing store.
std::unique_ptr<Store> openStore(const std::string& uri, OpenMode mode);

/// A store that lives and dies with the object.
std::unique_ptr<Store> openMemoryStore();

/// The URI in full, defaults filled in: what messages call the store. Throws StoreError for a kind
/// of store that there is not.
std::string storeUri(const std::string& uri);

/// The file of a store's URI.
std::string storePath(const std::string& uri);

}  // namespace afterglow::replay
