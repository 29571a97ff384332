/// \file
/// The transport of the console: HTTP/1.1 and WebSockets over TCP by Boost.Beast, with bounds on
/// all that a client can take.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "nodes/console/http_message.hpp"

namespace afterglow::nodes {

struct HttpLimits {
  std::size_t header_bytes = 16 << 10;
  std::size_t body_bytes = 64 << 10;
  /// A further one takes the place of the oldest that is idle, slow to ask or slow to take its
  /// answer, so that nobody can keep a stop out; without any such it is closed at once.
  std::size_t connections = 32;
  /// Number of responses that go on, and of WebSockets; further ones are refused.
  std::size_t streams = 16;
  std::chrono::milliseconds header_patience = std::chrono::seconds(2);  ///< after its first byte
  /// Time between two requests, for a request's body, and for taking a whole response; and that a
  /// WebSocket's client may be silent: it answers pings.
  std::chrono::milliseconds patience = std::chrono::seconds(20);
  int threads = 3;  ///< threads for requests that are not urgent
};

/// Listens and answers from its making to its end. Every response bears the headers that keep
/// browsers from guessing types, framing and sharing it.
class HttpServer {
 public:
  /// `address` in numbers, 127.0.0.1 or ::1; port 0: any that is free. Throws std::runtime_error
  /// where it cannot listen. The handler may block for a while; it must not for what is urgent,
  /// which is answered by threads of its own. Without `open_socket` there are no
  /// WebSockets.
  HttpServer(const std::string& address, std::uint16_t port, HttpHandler handler,
             std::function<bool(const HttpRequest&)> is_urgent = {}, HttpLimits limits = {},
             OpenSocket open_socket = {});
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;
  /// Closes all connections. Responses that come later are dropped.
  ~HttpServer();

  std::uint16_t port() const;
  /// Answers nobody any more, and does not call the handler. What holds Respond functions
  /// can then go, before the server does.
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace afterglow::nodes
