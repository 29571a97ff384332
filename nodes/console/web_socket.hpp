/// \file
/// WebSockets as values: frames on their way to a client, and whoever answers it. What speaks over
/// one is tested without sockets.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "nodes/console/http_message.hpp"

namespace afterglow::nodes {

/// A whole message of a WebSocket.
struct SocketFrame {
  bool is_text = false;  ///< false: binary
  std::string bytes;
};

/// The frames that wait for a client to take them, from any thread to the server's connection.
class FrameQueue {
 public:
  static constexpr std::size_t kMostLive = 8 << 20;   ///< bytes that pushLive() lets wait
  static constexpr std::size_t kMostAhead = 1 << 20;  ///< bytes beyond which there is no room
  /// Bytes of other frames: a client that lets more of them wait is dropped.
  static constexpr std::size_t kMostKept = 32 << 20;

  /// Adds a frame that the client has to get.
  void push(SocketFrame frame);
  /// Adds a binary frame that makes the oldest of its kind go if too much waits. Returns how many
  /// went.
  std::size_t pushLive(std::string bytes);
  /// Returns true if whoever can wait should send more.
  bool hasRoom() const;
  /// The connection ends, now.
  void close();
  bool isClosed() const;

  // The server's part.
  /// `wake` is called, in any thread, whenever there is something to take, or the queue is closed.
  void attach(std::function<void()> wake);
  /// Returns the oldest frame; empty: nothing waits.
  std::optional<SocketFrame> take();

 private:
  struct Waiting {
    SocketFrame frame;
    bool is_live = false;
  };
  void wake();

  mutable std::mutex mutex_;
  std::deque<Waiting> waiting_;
  std::size_t kept_bytes_ = 0, live_bytes_ = 0;
  bool is_closed_ = false;
  std::function<void()> wake_;
};

/// Answers one client, from the end of the handshake to the end of the connection.
class SocketService {
 public:
  virtual ~SocketService() = default;
  /// A frame of the client. One call at a time, in any of the server's threads for requests.
  virtual void take(const SocketFrame& frame) = 0;
};

/// A WebSocket that was granted.
struct OpenedSocket {
  std::string protocol;  ///< the subprotocol that both speak
  std::shared_ptr<SocketService> service;
};

/// Opens a WebSocket, whose client gets what is pushed. Throws HttpError to refuse it. May be
/// called by several threads at once.
using OpenSocket =
    std::function<OpenedSocket(const HttpRequest&, const std::shared_ptr<FrameQueue>&)>;

}  // namespace afterglow::nodes
