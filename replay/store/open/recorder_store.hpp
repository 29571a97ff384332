/// \file
/// The store of a recorder: a SQLite file on this machine, also where its behaviors belong on a
/// MongoDB server.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <shared_mutex>
#include <string>
#include <thread>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// The file in which a recorder for this server (a full URI) keeps what it records: spool-HASH.db
/// in $AFTERGLOW_SPOOL, else in ~/.local/share/afterglow. Throws StoreError if neither is known.
std::string recorderFile(const std::string& server);

struct SendOptions {
  std::string path;  ///< the file; empty: recorderFile()
  /// So long does the end wait until all is sent.
  std::chrono::milliseconds farewell{2000};
  /// The pause between two attempts; twice as long each time, up to 32 times.
  std::chrono::milliseconds pause{100};
  /// So often behaviors are looked for that have ended.
  std::chrono::milliseconds look{500};
};

/// The amount that a recorder is behind with its server.
struct SendStatus {
  std::size_t unsent = 0;   ///< behaviors that have ended and are not on the server
  std::string last_error;   ///< the reason why the last attempt failed; empty: all is well
  std::size_t refused = 0;  ///< behaviors that the server does not take, or not with all messages
  std::string last_refusal;  ///< reason of the last refusal
  std::string path;          ///< the file that holds all of these
};

/// A recorder writes into local() alone. For a server a thread copies each behavior there once it
/// has ended (syncBehaviors()), with the same id, again and again while the server is away. What
/// the server refuses holds up nothing: it stays in the file, and the next recorder tries it again.
/// Any thread.
class RecorderStore {
 public:
  /// `uri` as of openStore(). The server may be away. Throws StoreError; also if another recorder
  /// has the file open.
  explicit RecorderStore(const std::string& uri, SendOptions options = {});
  RecorderStore(const RecorderStore&) = delete;
  RecorderStore& operator=(const RecorderStore&) = delete;
  ~RecorderStore() { finish(); }

  Store& local() { return *local_; }
  /// The id of a new behavior: one that no two recorders will draw alike (from 2^40 up, 52 random
  /// bits), so that it is the same on the server. 0: the store itself gives one.
  std::int64_t newBehaviorId() const;
  /// Holds sending while a behavior is ended that may be discarded.
  std::shared_lock<std::shared_mutex> holdSending() {
    return std::shared_lock<std::shared_mutex>(ending_);
  }

  /// Removes from the file what the server has, if it ended before that stamp: a new behavior may
  /// reach back into what ended just now. Without a server nothing. Throws StoreError.
  void removeSent(Stamp ended_before);
  /// Runs `work` on the store in which behaviors stay: at once, or, for a server, by the thread as
  /// soon as that answers.
  void tend(std::function<void(Store&)> work);

  std::optional<SendStatus> status() const;  ///< empty without a server
  /// Waits at the end for a while until all is sent, instead of leaving it to the destructor.
  std::optional<SendStatus> finish();

 private:
  void run();
  void sendAll();
  std::vector<Behavior> unsent();
  void send(const Behavior& behavior);
  void keep(std::int64_t id, const std::string& why);
  bool isStopped() const;
  bool runsStill(std::int64_t parent) const;
  bool isSettled(std::int64_t parent) const;
  Store& server();

  const std::string uri_;
  const SendOptions options_;
  std::unique_ptr<Store> local_;
  std::unique_ptr<Store> reader_, server_;  ///< the thread's
  std::map<std::int64_t, int> failures_;    ///< failures by behavior; the thread's
  std::shared_mutex ending_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  /// Behaviors that the server has; false: without its parent, which still runs.
  std::map<std::int64_t, bool> sent_;
  std::set<std::int64_t> refused_;
  SendStatus status_;
  std::function<void(Store&)> tend_;
  bool is_ending_ = false, is_stopped_ = false;
  std::thread thread_;  ///< last: it uses all of the above
};

}  // namespace afterglow::replay
