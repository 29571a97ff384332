/// \file
/// The thread that sends a Spool to its server. Internal to replay/store.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "replay/store/mongo/spool.hpp"

namespace afterglow::replay {

class MongoStore;

/// Sends the entries of a spool in order, each again until the server has confirmed it; one that the
/// server refuses several times is set aside, and of its messages those alone that it does not take,
/// so that it holds up nothing. Keeps a reserve of behavior ids in the spool, which must outlive it.
class SpoolSender {
 public:
  /// Its end waits until all is sent, but no longer than `farewell`. Between two attempts it
  /// waits for `pause`; twice as long each time, up to 32 times.
  SpoolSender(Spool& spool, std::string uri, std::chrono::milliseconds farewell,
              std::chrono::milliseconds pause);
  ~SpoolSender();
  /// What the destructor does first; nothing is sent afterwards.
  void finish();
  SpoolSender(const SpoolSender&) = delete;
  SpoolSender& operator=(const SpoolSender&) = delete;

  void wake();                    ///< the spool has entries
  std::string lastError() const;  ///< why the last attempt failed; empty: all is well
  /// The server's store, opened when it is first needed. Throws StoreError while it cannot be.
  MongoStore& server() const;
  std::string serverName() const { return storeUri(uri_); }  ///< for texts

 private:
  void reserveIds();
  void run();
  bool sendSome();
  void send(const std::vector<Spool::Entry>& entries);
  void sendAlone(const Spool::Entry& entry);
  std::string nameOf(const std::vector<Message>& messages) const;
  static std::string nameOf(const Spool::Entry& entry);
  void sendBehavior(Behavior behavior);
  std::int64_t recordingOnServer(std::int64_t id);
  std::int64_t channelOnServer(std::int64_t id);

  Spool& spool_;
  const std::string uri_;
  const std::chrono::milliseconds farewell_, pause_;
  std::map<std::int64_t, std::int64_t> recordings_, channels_;  ///< the server's ids; the thread's
  int refusals_ = 0;                                            ///< of the first entry; likewise

  mutable std::mutex server_mutex_;  ///< for opening it
  mutable std::unique_ptr<MongoStore> server_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool has_news_ = true, is_ending_ = false, is_stopped_ = false;
  std::string last_error_;
  std::thread thread_;  ///< last: it uses all of the above
};

}  // namespace afterglow::replay
