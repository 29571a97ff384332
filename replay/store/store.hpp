/// \file
/// The store: one message log and, over it, behaviors as intervals. The log is divided into
/// recordings (a run of a recorder, an imported bag), so that two recordings of the same minute
/// never mix. A message is stored once, however many behaviors cover it.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

class Filter;

/// The store cannot be opened, read or written; the text names the store, what was tried and why.
class StoreError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Another process has kept the store locked for too long. Nothing was written; a later attempt may
/// succeed.
class StoreBusy : public StoreError {
 public:
  using StoreError::StoreError;
};

/// The server of a store cannot be reached, or answers that it cannot now. A later attempt may
/// succeed.
class StoreAway : public StoreError {
 public:
  using StoreError::StoreError;
};

/// A message that no store takes. Nothing of its batch was stored; the others can be appended
/// without it.
class MessageRefused : public StoreError {
 public:
  MessageRefused(const std::string& text, std::size_t place) : StoreError(text), place_(place) {}
  std::size_t place() const { return place_; }  ///< place in the batch

 private:
  std::size_t place_;
};

/// A part of the log: one run of a recorder, one imported bag.
struct Recording {
  std::int64_t id = 0;  ///< given by the store
  std::string key;      ///< the same in every store it is copied to; 32 hex digits
  std::string source;   ///< source: the recorder's node name, the bag's path
  std::string robot;
};

/// An execution of one behavior.
struct Behavior {
  std::int64_t id = 0;         ///< given by the store
  std::string key;             ///< the same in every store it is copied to; 32 hex digits
  std::int64_t recording = 0;  ///< the part of the log it lies in
  std::string name;
  std::string tree_path;    ///< place in the behavior tree, e.g. "kitting/pick"; may be empty
  std::int64_t parent = 0;  ///< enclosing behavior; 0: none
  int attempt = 1;
  std::string outcome;       ///< "success", "failure", "stopped", ...; empty while it runs
  Stamp begin;               ///< inclusive
  std::optional<Stamp> end;  ///< exclusive; empty: still running, or its recorder died
  Stamp wall_begin;          ///< the wall clock at its begin: ROS time may be a simulation's
  std::string robot;
  std::string parameters = "{}";  ///< JSON object
  std::vector<std::string> tags;
  std::string calibration = "{}";   ///< JSON object: the projector's calibration in use
  std::vector<std::string> topics;  ///< the topics that belong to it, heard or not
  /// JSON object: what replay needs later: frames, files, urdf, request (record/snapshot).
  std::string snapshot = "{}";
  /// Faults of its recording, one sentence each: drops, clock jumps, a crash.
  std::vector<std::string> remarks;
};

/// The outcome of a behavior whose recorder died; it ends with its recording's last message.
constexpr const char* kIncomplete = "incomplete";

/// A recorder keeps the transforms of so long before a behavior, too, as long as tf2 remembers
/// them: a camera's picture of its begin comes later than it was taken.
constexpr std::int64_t kTransformsBefore_ns = 10'000'000'000;
constexpr const char* kTransforms = "/tf";

/// A choice of behaviors; unset members match everything. A behavior without an end is taken to
/// reach to its recording's last message.
struct BehaviorFilter {
  std::optional<std::string> name;
  std::optional<std::string> outcome;
  std::optional<std::string> topic;  ///< own topic, with at least one message
  std::optional<Stamp> since;        ///< end after this
  std::optional<Stamp> until;        ///< begin before this
  std::optional<std::string> robot;
  std::optional<std::string> tag;
  std::shared_ptr<const Filter> where;  ///< filter by fields and messages (query/filter.hpp)
  std::optional<std::size_t> limit;     ///< only so many, the newest
};

/// The amount that a behavior holds on one topic (of one type).
struct TopicSummary {
  std::string topic;
  std::string type;
  std::uint64_t count = 0;
  Stamp first, last;  ///< stamps of the first and the last message

  std::optional<double> rate_hz() const;  ///< messages a second; empty for a single one
};

/// A choice of the messages of a behavior's recording in a behavior's interval. Without an end it
/// reaches to the recording's last message.
struct MessageRange {
  /// Empty: the behavior's own. Others of the recording may be named: its context (/tf, ...).
  std::vector<std::string> topics;
  std::optional<Stamp> begin = {};  ///< inclusive
  std::optional<Stamp> end = {};    ///< exclusive
  bool with_all_topics = false;     ///< all that the recording has, whatever `topics` says
  std::shared_ptr<const Filter> where = nullptr;  ///< filter by fields (query/filter.hpp)
};

/// The end of an interval that has none.
constexpr Stamp kEndOfTime{std::numeric_limits<std::int64_t>::max()};

/// The treatment by append() of a message that its recording has already.
enum class Duplicates { Refuse, Skip };

/// A message that was left out in reading, as its bytes are not those that were stored.
struct DamagedMessage {
  std::int64_t channel = 0;
  Stamp received;
  std::uint64_t sequence = 0;
  std::string problem;
};

/// Forward reader in total order: receive stamp, then sequence. Reads ahead with bounded memory;
/// valid while its store lives. Throws StoreError when reading fails.
class MessageCursor {
 public:
  virtual ~MessageCursor() = default;
  virtual std::optional<Message> next() = 0;  ///< empty at the end
  /// Messages that were left out so far.
  virtual std::vector<DamagedMessage> damaged() const { return {}; }
};

/// A store of behaviors; every method throws StoreError on failure and may be called from any
/// thread.
class Store {
 public:
  virtual ~Store() = default;

  // ---------------------------------------------------------------------------------- writing
  /// A new part of the log, its id ignored; an empty key is made. The one there is if the key is
  /// known.
  virtual std::int64_t addRecording(const Recording& recording) = 0;
  /// A new recording with a new key, whose messages come in many appends. Until finishImport() it
  /// has no behavior, so that nobody finds it; if the caller's program dies before that,
  /// dropUnfinished() drops it.
  virtual std::int64_t beginImport(const Recording& recording) = 0;
  /// Finishes an import, in the transaction that adds its behaviors.
  virtual void finishImport(std::int64_t recording) = 0;
  /// Drops a recording without behaviors, with its messages and channels; in slices, between which
  /// others can write. Nothing may be appended to its channels afterwards.
  virtual void dropRecording(std::int64_t recording) = 0;
  /// Drops the recordings of imports whose programs have died before the end; returns how many.
  virtual std::size_t dropUnfinished() = 0;
  /// Id of this channel in this recording, stored on first sight; definitions are stored once.
  virtual std::int64_t addChannel(std::int64_t recording, const Channel& channel) = 0;
  /// All or none of these messages. A message is identified by recording, stamp and sequence.
  virtual void append(const std::vector<Message>& messages,
                      Duplicates duplicates = Duplicates::Refuse) = 0;
  /// Stores a behavior and returns its id, a new one if it has none. An empty key is made; a known
  /// one is refused.
  virtual std::int64_t addBehavior(const Behavior& behavior) = 0;
  /// Replaces the stored one of this id, but for its key and recording.
  virtual void updateBehavior(const Behavior& behavior) = 0;
  /// Drops the behavior, and the messages of its recording that no other behavior covers. Its
  /// children become its parent's.
  virtual void removeBehavior(std::int64_t id) = 0;
  /// Keeps the contents of a file (speech, a mesh) by their SHA-256, 64 hex digits; once.
  virtual void addFile(const std::string& sha256, const Bytes& contents) = 0;
  /// Runs `work`, whose writes to this store are kept as a whole when it returns and dropped as a
  /// whole when it throws; the exception goes on. Other threads and processes wait to write, and
  /// read what was there before.
  virtual void transaction(const std::function<void()>& work) = 0;
  /// Gives the room that removing freed back to the disk, instead of using it for new messages.
  /// Refused while somebody records into the store.
  virtual void compact() {}

  // ---------------------------------------------------------------------------------- reading
  virtual std::vector<Recording> recordings() const = 0;  ///< recordings by id
  /// Newest first (by begin, then id).
  virtual std::vector<Behavior> behaviors(const BehaviorFilter& filter) const = 0;
  /// Explains behaviors(filter), a line for each step: index or scan, and how many it looked at.
  virtual std::vector<std::string> explain(const BehaviorFilter& filter) const = 0;
  virtual std::optional<Behavior> behavior(std::int64_t id) const = 0;
  virtual std::optional<Behavior> behaviorOfKey(const std::string& key) const = 0;
  /// Summarizes what was heard on its own topics, by topic, then type.
  virtual std::vector<TopicSummary> topics(const Behavior& behavior) const = 0;
  /// Summarizes what was heard on other topics of its recording in its interval.
  virtual std::vector<TopicSummary> contextTopics(const Behavior& behavior) const = 0;
  virtual Channel channel(std::int64_t id) const = 0;
  virtual std::unique_ptr<MessageCursor> messages(const Behavior& behavior,
                                                  const MessageRange& range) const = 0;
  /// Contents of a file; empty if there is none of that SHA-256.
  virtual std::optional<Bytes> file(const std::string& sha256) const = 0;
  /// Size in bytes, without room for new messages; empty if the store does not know it.
  virtual std::optional<std::uint64_t> usedBytes() const { return std::nullopt; }
  /// The folder on this machine's disk in which it grows; empty if it grows elsewhere.
  virtual std::string folder() const { return {}; }
};

/// Throws StoreError with the store's name in front unless the behavior's parameters, calibration
/// and snapshot are JSON objects.
void checkObjects(const Behavior& behavior, const std::string& store);

/// Ends a behavior whose recorder died, behind the last message of its recording if it has one, and
/// remarks on it.
void endIncomplete(Behavior& behavior, std::optional<std::int64_t> last_message_ns);

/// Returns true if its recorder runs, or died.
inline bool isOpen(const Behavior& behavior) { return !behavior.end && behavior.outcome.empty(); }

/// 32 random hex digits: a key that no other recording or behavior has.
std::string newKey();

/// The purpose for which a store is opened (by store/open/open_store.hpp). ReadOnly demands an
/// existing store, the others make a new one. Record is for a recorder, of which a store has one at
/// a time: behaviors that the last one left open are marked kIncomplete.
enum class OpenMode { ReadOnly, ReadWrite, Record };

/// The URI in full, defaults filled in: "sqlite:PATH" for a plain path too; empty:
/// $AFTERGLOW_STORE, else ~/.local/share/afterglow/afterglow.db. Throws StoreError for an unknown
/// kind of store.
/// "@FILE": the first line of that file, for a URI with a password; $AFTERGLOW_STORE may say so,
/// too.
std::string fullStoreUri(const std::string& uri);

/// Throws StoreError for a URI with a password in a place that others can read, named `where`: a
/// parameter of the parameter server.
void refusePassword(const std::string& where, const std::string& uri);

/// $HOME, else the account's; empty if neither says.
std::string homeFolder();

/// Returns true if a full URI is a MongoDB server's.
bool isServerUri(const std::string& uri);

/// fullStoreUri(), a server's without user, password and options: the store's name in messages.
std::string storeUri(const std::string& uri);

/// The file of a store's URI; throws StoreError for a server's.
std::string storePath(const std::string& uri);

}  // namespace afterglow::replay
