/// \file
/// Writes that wait on this machine's disk for a server, in the order in which they were made.
/// Internal to replay/store.
///
/// One SQLite database in WAL mode, FULL: writes survive a loss of power once their methods return.
///   outbox      id (order), kind, messages (how many), payload (spool_entries.hpp)
///   recordings  id (the spool's own), key, source, robot, last_ns (its last message's stamp)
///   channels    id (the spool's own), recording, topic, type, md5, definition, latching, caller_id
///   behaviors   id (the server's), key, is_open, state (BSON, mongo_layout.hpp; its recording is
///               the spool's id): those that run or wait to be sent
///   refused     as the outbox, and why: entries that the server does not take
///   ids         next, last: behavior ids that the server has reserved for this spool
/// Everything in the outbox names recordings and channels by the spool's ids; the sender
/// translates.
#pragma once

#include <functional>
#include <memory>

#include "replay/store/sqlite/sqlite.hpp"
#include "replay/store/sqlite/sqlite_recordings.hpp"
#include "replay/store/sqlite/store_locks.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Every method may be called from any thread and throws StoreError.
class Spool {
 public:
  enum class Kind { Messages, Behavior, Removal, File };
  struct Entry {
    std::int64_t id = 0;
    Kind kind = Kind::Messages;
    std::uint64_t messages = 0;
    Bytes payload;
  };

  /// The file, made if need be. Behaviors that the last recorder left open end as kIncomplete.
  /// Throws if another recorder has it open. Writes that would make more than `most_bytes` wait are
  /// refused.
  Spool(const std::string& path, std::uint64_t most_bytes);

  std::int64_t addRecording(const Recording& recording);
  std::int64_t addChannel(std::int64_t recording, const Channel& channel);
  void append(const std::vector<Message>& messages);
  /// Keeps the state of a behavior and sends it. Of one that is not in the spool only its state is
  /// sent: the server knows its recording.
  void putBehavior(const Behavior& behavior);
  void removeBehavior(std::int64_t id);
  void addFile(const std::string& sha256, const Bytes& contents);
  void transaction(const std::function<void()>& work);

  Recording recording(std::int64_t id) const;
  std::int64_t recordingOf(std::int64_t channel);
  Channel channel(std::int64_t id) const;
  std::optional<Behavior> behavior(std::int64_t id) const;
  std::optional<Behavior> behaviorOfKey(const std::string& key) const;

  /// An id for a new behavior: a reserved one, else one from 2^40 up that no two spools will ever
  /// draw alike (52 random bits).
  std::int64_t takeBehaviorId();
  std::int64_t idsLeft() const;
  void giveIds(std::int64_t first, std::int64_t count);

  /// The oldest entries: one, or several of messages up to about `bytes`.
  std::vector<Entry> front(std::size_t bytes) const;
  /// To be called when the server has the entries that front() gave.
  void confirm(const std::vector<Entry>& entries);
  /// For an entry that the server refuses: it is confirmed but for `payload`, its `messages`
  /// messages that are refused, and what it is, which stays until the spool is opened again.
  void setAside(const Entry& entry, std::uint64_t messages, const Bytes& payload,
                const std::string& why);
  /// Without an error.
  SpoolStatus unsent() const;

 private:
  void add(Kind kind, std::uint64_t messages, const Bytes& payload);
  void count();
  void takeUpRefused();
  void closeOpenBehaviors();
  void tidy();

  const std::uint64_t most_bytes_;
  const RecorderLock recorder_;
  const std::unique_ptr<SqliteConnection> connection_;
  SqliteRecordings recordings_;
  SpoolStatus unsent_;
  std::uint64_t refused_bytes_ = 0;
};

}  // namespace afterglow::replay
