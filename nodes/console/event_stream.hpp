/// \file
/// A response that goes on: server-sent events.
#pragma once

#include <cstddef>
#include <functional>
#include <mutex>
#include <string>
#include <utility>

namespace afterglow::nodes {

/// Between who has something to say and the server's connection; any thread. Text waits in it until
/// the client takes it; a client that does not take kMostWaiting is dropped.
class EventStream {
 public:
  static constexpr std::size_t kMostWaiting = 256 << 10;  ///< bytes

  /// `on_gone` is called once, in any thread, when the client is gone, or dropped, or the stream is
  /// closed.
  explicit EventStream(std::function<void()> on_gone) : on_gone_(std::move(on_gone)) {}

  /// Events as they go over the wire, "event: state\ndata: {}\n\n". Nothing for who is gone.
  void push(const std::string& text);
  /// The connection ends.
  void close();
  bool isClosed() const;

  // The server's part.
  /// `wake` is called, in any thread, whenever there is something to take, or the stream is closed.
  void attach(std::function<void()> wake);
  /// All that waits.
  std::string take();

 private:
  void wake();

  mutable std::mutex mutex_;
  std::string waiting_;
  bool is_closed_ = false;
  std::function<void()> wake_, on_gone_;
};

}  // namespace afterglow::nodes
