// Reads the spools of earlier versions, SQLite databases with recordings and channels by ids of
// their own, behaviors that ran or waited, and `outbox`, what waited for the server, in order
// (`refused`: what it did not take).
#include <cstring>
#include <filesystem>
#include <map>

#include "replay/store/mongo/mongo_layout.hpp"
#include "replay/store/mongo/mongo_open.hpp"
#include "replay/store/sqlite/sqlite_store.hpp"

namespace afterglow::replay {
namespace {

namespace fs = std::filesystem;

/// Kinds of the outbox; 1: a state of a behavior, 2: the removal of one.
constexpr std::int64_t kMessages = 0, kFile = 3;

/// The bytes of an entry, which are trusted, but not beyond their end.
class EntryReader {
 public:
  explicit EntryReader(const Bytes& bytes) : bytes_(bytes) {}
  bool atEnd() const { return at_ == bytes_.size(); }
  template <typename T>
  T get() {
    T value;
    std::memcpy(&value, take(sizeof value), sizeof value);
    return value;
  }
  const std::uint8_t* take(std::size_t size) {
    if (bytes_.size() - at_ < size) throw StoreError("the spool is damaged: an entry is cut off");
    at_ += size;
    return bytes_.data() + at_ - size;
  }
  std::size_t left() const { return bytes_.size() - at_; }

 private:
  const Bytes& bytes_;
  std::size_t at_ = 0;
};

/// The store's id for one of the spool's.
std::int64_t knownId(const std::map<std::int64_t, std::int64_t>& ids, const char* what,
                     std::int64_t id) {
  const auto known = ids.find(id);
  if (known != ids.end()) return known->second;
  throw StoreError(std::string("the spool is damaged: ") + what + " " + std::to_string(id) +
                   " is missing");
}

class OldSpool {
 public:
  OldSpool(const std::string& path, Store& store)
      : connection_(path, SqliteAccess::ReadOnly), store_(store) {}

  void convert() {
    convertChannels();
    const bool has_refused =
        connection_.integer("SELECT count(*) FROM sqlite_schema WHERE name = 'refused'") > 0;
    convertEntries("outbox");
    if (has_refused) convertEntries("refused");
    convertBehaviors();
  }

 private:
  void convertChannels() {
    SqliteStatement recordings(connection_, "SELECT id, key, source, robot FROM recordings");
    while (recordings.step()) {
      recordings_[recordings.integer(0)] = store_.addRecording(
          {0, recordings.text(1), recordings.text(2), recordings.text(3)});
    }
    SqliteStatement channels(connection_,
                             "SELECT id, recording, topic, type, md5, definition, latching, "
                             "caller_id FROM channels");
    while (channels.step()) {
      const Channel channel{channels.text(2), channels.text(3),         channels.text(4),
                            channels.text(5), channels.integer(6) != 0, channels.text(7)};
      channels_[channels.integer(0)] =
          store_.addChannel(knownId(recordings_, "recording", channels.integer(1)), channel);
    }
  }

  void convertEntries(const std::string& table) {
    SqliteStatement entries(connection_, "SELECT kind, payload FROM " + table + " ORDER BY id");
    while (entries.step()) {
      const Bytes payload = entries.bytes(1);
      EntryReader reader(payload);
      if (entries.integer(0) == kMessages) store_.append(messagesIn(reader), Duplicates::Skip);
      if (entries.integer(0) != kFile) continue;
      const auto size = reader.get<std::uint64_t>();
      const std::string sha256(reinterpret_cast<const char*>(reader.take(size)), size);
      const std::size_t left = reader.left();
      const std::uint8_t* contents = reader.take(left);
      store_.addFile(sha256, Bytes(contents, contents + left));
    }
  }

  std::vector<Message> messagesIn(EntryReader& reader) const {
    std::vector<Message> messages;
    while (!reader.atEnd()) {
      Message message;
      message.channel = knownId(channels_, "channel", reader.get<std::int64_t>());
      message.received = {reader.get<std::int64_t>()};
      message.sequence = reader.get<std::uint64_t>();
      const bool has_header = reader.get<std::uint8_t>() != 0;
      const Stamp header{reader.get<std::int64_t>()};
      if (has_header) message.header_stamp = header;
      const auto size = reader.get<std::uint64_t>();
      const std::uint8_t* bytes = reader.take(size);
      message.bytes.assign(bytes, bytes + size);
      messages.push_back(std::move(message));
    }
    return messages;
  }

  void convertBehaviors() {
    SqliteStatement states(connection_, "SELECT state FROM behaviors");
    while (states.step()) {
      const Bytes bytes = states.bytes(0);
      bson_t state;
      if (!bson_init_static(&state, bytes.data(), bytes.size())) {
        throw StoreError("the spool is damaged: a behavior is no BSON");
      }
      Behavior behavior = behaviorFromMongo(state);
      if (store_.behaviorOfKey(behavior.key)) continue;
      if (!behavior.end) {
        SqliteStatement last(connection_, "SELECT last_ns FROM recordings WHERE id = ?1");
        last.bind(1, behavior.recording);
        endIncomplete(behavior, last.step() ? last.optionalInteger(0) : std::nullopt);
      }
      behavior.recording = knownId(recordings_, "recording", behavior.recording);
      store_.addBehavior(behavior);
    }
  }

  SqliteConnection connection_;
  Store& store_;
  std::map<std::int64_t, std::int64_t> recordings_, channels_;  ///< the store's ids, by the spool's
};

bool isSpool(const std::string& path) {
  if (!fs::exists(path)) return false;
  SqliteConnection connection(path, SqliteAccess::ReadOnly);
  return connection.integer("SELECT count(*) FROM sqlite_schema WHERE name = 'outbox'") > 0;
}

/// Gives it another name, once all of it is in its one file. The disk keeps the name before a store
/// is begun under the old one.
void setAside(const std::string& path, const std::string& aside) {
  const RecorderLock nobody_records(path);
  SqliteConnection(path, SqliteAccess::ReadWriteCreate).execute("PRAGMA journal_mode = DELETE");
  fs::rename(path, aside);
  requireSyncedName(aside);
}

}  // namespace

void convertSpool(const std::string& path) {
  const std::string aside = path + ".old";
  if (isSpool(path)) setAside(path, aside);
  if (!fs::exists(aside)) return;
  {
    SqliteStore store(path, OpenMode::ReadWrite);
    OldSpool(aside, store).convert();
  }
  fs::remove(aside);
}

}  // namespace afterglow::replay
