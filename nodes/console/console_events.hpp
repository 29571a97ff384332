/// \file
/// /api/events: the state, told to all pages alike.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "nodes/console/http_message.hpp"
#include "replay/clock/worker_thread.hpp"

namespace afterglow::nodes {

/// Any thread. A thread of its own asks for the state five times a second, and tells it when it is
/// another one; whoever comes is told at once.
class ConsoleEvents {
 public:
  static constexpr std::chrono::milliseconds kPeriod{200};
  static constexpr std::size_t kMostPages = 16;

  struct Sources {
    std::function<std::string()> state;  ///< JSON in one line
    std::function<std::size_t()> total;  ///< behaviors in the store
  };
  explicit ConsoleEvents(Sources sources);
  /// Ends all streams.
  ~ConsoleEvents();

  /// A page that listens. Throws HttpError 503 where too many do.
  HttpResponse open(const std::string& session);
  /// Returns true if a page of this session listens; false for an empty one.
  bool isListening(const std::string& session) const;

 private:
  struct Page {
    std::string session;
    std::shared_ptr<EventStream> stream;
  };
  void look();
  void tell(const std::string& text);
  void close(std::uint64_t page);

  const Sources sources_;
  mutable std::mutex mutex_;
  std::map<std::uint64_t, Page> pages_;
  std::uint64_t pages_ever_ = 0;
  std::string newest_;  ///< the event of the state
  std::size_t total_ = 0;  ///< number that was told last
  int silent_ = 0;         ///< periods without news
  replay::RepeatingThread thread_{kPeriod, [this] { look(); }};
};

}  // namespace afterglow::nodes
