/// \file
/// The transport of the console: HTTP/1.1 over TCP by Boost.Beast, with bounds on all that a client
/// can take.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "nodes/console/http_message.hpp"

namespace afterglow::nodes {

struct HttpLimits {
  std::size_t header_bytes = 16 << 10;
  std::size_t body_bytes = 64 << 10;
  std::size_t connections = 32;  ///< further ones are closed at once
  /// For a whole request, from the end of the last one; for taking a whole response.
  std::chrono::milliseconds patience = std::chrono::seconds(20);
  int threads = 3;
};

/// Listens and answers from its making to its end. Every response bears the headers that keep
/// browsers from guessing types, framing and sharing it.
class HttpServer {
 public:
  /// `address` in numbers, 127.0.0.1 or ::1; port 0: any that is free. Throws std::runtime_error
  /// where it cannot listen. The handler must not block for long: it has the threads of all.
  HttpServer(const std::string& address, std::uint16_t port, HttpHandler handler,
             HttpLimits limits = {});
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;
  /// Closes all connections. Responses that come later are dropped.
  ~HttpServer();

  std::uint16_t port() const;
  /// From now on nobody is answered, and the handler is not called. What holds Respond functions
  /// can then go, before the server does.
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace afterglow::nodes
