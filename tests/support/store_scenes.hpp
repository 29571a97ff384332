/// \file
/// Work of programs with stores and recordings on a disk, and what they were told is kept: for a
/// disk, or memory, that fails meanwhile.
#pragma once

#include <functional>
#include <map>
#include <new>
#include <set>
#include <string>
#include <vector>

#include "replay/bags/bag_file.hpp"
#include "replay/record/recorder.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/sqlite/sqlite_store.hpp"
#include "replay/store/sqlite/store_care.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/system_calls.hpp"

namespace afterglow::test {

/// Everything that was acknowledged, and is not to be lost.
struct Kept {
  struct Promise {
    bool has_ended = false;
    std::uint64_t messages = 0;  ///< at least
  };
  std::map<std::string, Promise> behaviors;                ///< by key
  std::map<std::string, std::set<std::uint64_t>> exports;  ///< messages, one of these, by file
};

/// Hears what a scene is told. A scene goes on after an error, as a program would.
class Witness {
 public:
  virtual ~Witness() = default;
  /// From now on this is what is kept. It was withdrawn before it is given up.
  virtual void onKept(const Kept& kept) = 0;
  /// What a person reads.
  virtual void onError(const std::string& text) = 0;

  void tell(const char* error) {
    const UncountedCalls uncounted;
    onError(error);
  }

  void keep(const std::string& key, bool has_ended, std::uint64_t messages) {
    const UncountedCalls uncounted;
    kept_.behaviors[key] = {has_ended, messages};
    onKept(kept_);
  }
  void withdraw(const std::string& key) {
    const UncountedCalls uncounted;
    kept_.behaviors.erase(key);
    onKept(kept_);
  }
  void keepExport(const std::string& file, std::set<std::uint64_t> messages) {
    kept_.exports[file] = std::move(messages);
    onKept(kept_);
  }
  /// As the edges of programs do (nodes/verbs/command.cpp).
  template <typename Work>
  bool attempt(const Work& work) {
    try {
      work();
      return true;
    } catch (const std::bad_alloc&) {
      tell("not enough memory");
    } catch (const std::exception& error) {
      tell(error.what());
    }
    return false;
  }

 private:
  Kept kept_;
};

using Scene = std::function<void(const std::string& folder, Witness& witness)>;

namespace scenes {

using namespace replay;

/// In folders that are new, too.
inline std::string storeIn(const std::string& folder) { return folder + "/robots/fetch/store.db"; }

/// Folded and begun anew every few commits.
inline SqliteLimits shortLog() {
  SqliteLimits limits;
  limits.fold_log_pages = 8;
  limits.longest_log_pages = 32;
  return limits;
}

inline Behavior behaviorOf(const std::string& name, std::int64_t begin_ns) {
  Behavior behavior = sampleBehavior(0, {"/a", "/b"}, begin_ns, begin_ns + 1);
  behavior.end.reset();
  behavior.key = newKey();
  behavior.name = name;
  behavior.parameters = R"({"object": "cup"})";
  return behavior;
}

inline std::string textOf(std::int64_t i) {
  return std::string(static_cast<std::size_t>(i * 7919 % 3000), static_cast<char>('a' + i % 26));
}

/// The recorder's core: behaviors one after the other, one of them taken back.
inline void record(const std::string& folder, Witness& witness) {
  std::int64_t now_ns = 1'000'000'000;
  std::unique_ptr<Store> store;
  std::unique_ptr<Recorder> recorder;
  const bool is_open = witness.attempt([&] {
    store = openStore(storeIn(folder), OpenMode::Record);
    RecorderOptions options;
    options.batch_period = std::chrono::milliseconds(1);
    options.context_topics = {"/tf"};
    options.pre_roll = std::chrono::seconds(1);
    recorder = std::make_unique<Recorder>(*store, options);
  });
  if (!is_open) return;
  std::vector<std::size_t> channels;
  const auto offer = [&](std::int64_t i) {
    witness.attempt([&] {
      recorder->offer(channels.at(static_cast<std::size_t>(i) % channels.size()),
                      Stamp{now_ns += 1000}, stringBytes(textOf(i)));
    });
  };
  for (const auto& [topic, is_latched] :
       {std::pair("/a", false), std::pair("/b", true), std::pair("/tf", false)}) {
    witness.attempt([&, name = topic, latch = is_latched] {
      channels.push_back(recorder->channelIndex(stringChannel(name, "/talker", latch)));
    });
  }
  if (channels.empty()) return;
  for (std::int64_t i = 0; i < 6; ++i) offer(i);
  for (int round = 0; round < 6; ++round) {
    std::optional<Behavior> behavior;
    witness.attempt([&] {
      Behavior asked = behaviorOf("pick", now_ns);
      RecordingTerms terms;
      terms.pre_roll_ns = 3000;
      behavior = recorder->begin(asked, terms);
      behavior->key = asked.key;
    });
    for (std::int64_t i = 0; i < 30; ++i) offer(30 * round + i);
    if (!behavior) continue;
    witness.keep(behavior->key, false, 0);
    witness.attempt([&] { recorder->addTopics(behavior->id, {"/later"}); });
    const bool has_ended = witness.attempt([&] {
      const auto counts = recorder->end(behavior->id, Stamp{now_ns += 1000}, outcome("success"));
      witness.keep(behavior->key, !recorder->failure(), counts.stored);
    });
    if (const auto failure = recorder->failure()) witness.tell(failure->c_str());
    if (round != 3 || !has_ended) continue;
    witness.withdraw(behavior->key);
    witness.attempt([&] { recorder->discard(behavior->id); });
  }
}

/// A store whose log is folded all the time: appends, a file, a behavior that goes, room given
/// back.
inline void append(const std::string& folder, Witness& witness) {
  witness.attempt([&] {
    SqliteStore store(storeIn(folder), OpenMode::Record, shortLog());
    const auto recording = store.addRecording({0, "", "x", ""});
    const auto channel = store.addChannel(recording, stringChannel("/a"));
    std::vector<Behavior> behaviors;
    for (std::int64_t round = 0; round < 12; ++round) {
      Behavior behavior = behaviorOf("place", round * 1000);
      behavior.recording = recording;
      behavior.end = Stamp{round * 1000 + 1000};
      behavior.outcome = "success";
      behavior.id = store.addBehavior(behavior);
      behaviors.push_back(behavior);
      witness.keep(behavior.key, true, 0);
      std::uint64_t stored = 0;
      for (int batch = 0; batch < 3; ++batch) {
        std::vector<Message> messages;
        for (int i = 0; i < 10; ++i, ++stored) {
          const auto at = round * 1000 + static_cast<std::int64_t>(stored);
          messages.push_back(
              stringMessage(channel, at, static_cast<std::uint64_t>(at), textOf(at)));
        }
        store.append(messages);
        witness.keep(behavior.key, true, stored);
      }
    }
    for (const int removed : {2, 3, 4, 5}) {
      witness.withdraw(behaviors[static_cast<std::size_t>(removed)].key);
      store.removeBehavior(behaviors[static_cast<std::size_t>(removed)].id);
    }
    store.compact();
  });
}

/// A file of `format` with 200 messages of one behavior; returns how many.
inline std::uint64_t writeRecording(const std::string& path, RecordingFormat format,
                                    int messages = 200) {
  const auto store = openMemoryStore();
  const auto recording = store->addRecording({0, "", "x", ""});
  const auto channel = store->addChannel(recording, stringChannel("/a"));
  std::vector<Message> batch;
  for (int i = 0; i < messages; ++i) {
    batch.push_back(stringMessage(channel, 1 + i, static_cast<std::uint64_t>(i), textOf(i)));
  }
  store->append(batch);
  Behavior behavior = sampleBehavior(recording, {"/a"}, 0, 1'000'000);
  behavior.id = store->addBehavior(behavior);
  BagExport asked;
  asked.format = format;
  asked.compression = BagCompression::Lz4;
  return exportBags(*store, {behavior}, {}, path, asked).messages;
}

/// Two imports of the file into a store.
inline void import(const std::string& file, const std::string& folder, Witness& witness) {
  for (int round = 0; round < 2; ++round) {
    witness.attempt([&] {
      SqliteStore store(storeIn(folder), OpenMode::ReadWrite, shortLog());
      const BagImportResult result = importBag(file, store);
      witness.keep(store.behavior(result.behavior.id).value().key, false, result.messages);
    });
  }
}

/// A file that is made, then overwritten.
inline void exportTo(const std::string& file, RecordingFormat format, const std::string& folder,
                     Witness& witness) {
  const bool is_there = witness.attempt([&] { writeRecording(folder + "/" + file, format, 50); });
  if (is_there) witness.keepExport(file, {50});
  if (is_there) witness.keepExport(file, {50, 200});
  witness.attempt([&] {
    writeRecording(folder + "/" + file, format, 200);
    witness.keepExport(file, {200});
  });
}

/// A store with something in it, which is repaired.
inline void repair(const std::string& folder, Witness& witness) {
  witness.attempt([&] {
    {
      SqliteStore store(storeIn(folder), OpenMode::ReadWrite);
      const auto recording = store.addRecording({0, "", "x", ""});
      const auto channel = store.addChannel(recording, stringChannel("/a"));
      Behavior behavior = behaviorOf("place", 0);
      behavior.recording = recording;
      behavior.end = Stamp{1000};
      behavior.outcome = "success";
      store.addBehavior(behavior);
      for (std::int64_t i = 0; i < 40; ++i) {
        store.append({stringMessage(channel, i, static_cast<std::uint64_t>(i), textOf(i))});
      }
      witness.keep(behavior.key, true, 40);
    }
    repairStore(storeIn(folder));
  });
}

}  // namespace scenes

/// What is wrong with what is left in the folder: everything that was kept is there, the store is
/// sound, and it is recorded into.
inline std::vector<std::string> faultsIn(const std::string& folder, const Kept& kept) {
  using namespace replay;
  std::vector<std::string> faults;
  const std::string path = scenes::storeIn(folder);
  try {
    for (const auto& [file, messages] : kept.exports) {
      const std::uint64_t found = summarizeBag(folder + "/" + file).messages;
      if (messages.count(found) == 0) faults.push_back(file + ": other messages");
    }
    const auto store = openStore(path, OpenMode::Record);
    SqliteConnection connection(path, SqliteAccess::ReadOnly);
    SqliteStatement check(connection, "PRAGMA integrity_check");
    while (check.step()) {
      if (check.text(0) != "ok") faults.push_back("SQLite: " + check.text(0));
    }
    for (const std::string& problem : checkStore(path).problems) faults.push_back(problem);
    for (const auto& [key, promise] : kept.behaviors) {
      const auto behavior = store->behaviorOfKey(key);
      if (!behavior) {
        faults.push_back("a behavior is lost");
        continue;
      }
      if (promise.has_ended && behavior->outcome != "success") faults.push_back("an end is lost");
      const std::size_t found = readAll(*store->messages(*behavior, {})).size();
      if (found >= promise.messages) continue;
      faults.push_back(std::to_string(found) + " messages of " + std::to_string(promise.messages));
    }
    store->dropUnfinished();
    const auto recording = store->addRecording({0, "", "afterwards", ""});
    const auto channel = store->addChannel(recording, stringChannel("/a"));
    store->append({stringMessage(channel, 1, 1, "afterwards")});
  } catch (const std::exception& error) {
    faults.push_back(error.what());
  }
  return faults;
}

}  // namespace afterglow::test
