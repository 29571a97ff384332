/// \file
/// Requests and responses as values: routes are tested without sockets.
///
/// WebSockets as values: frames on their way to a client, and whoever answers it. What speaks over
/// one is tested without sockets.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace afterglow::nodes {

/// The events of a response that goes on (server-sent events), from any thread to the server's
/// connection. Text waits in it until the client takes it; a client that does not take kMostWaiting
/// is dropped.
class EventStream {
 public:
  static constexpr std::size_t kMostWaiting = 256 << 10;  ///< bytes

  /// `on_gone` is called once, in any thread, when the client is gone, or dropped, or the stream is
  /// closed.
  explicit EventStream(std::function<void()> on_gone) : on_gone_(std::move(on_gone)) {}

  /// Adds events as they go over the wire, "event: state\ndata: {}\n\n", unless the client is gone.
  void push(const std::string& text);
  /// The connection ends.
  void close();
  bool isClosed() const;

  // The server's part.
  /// `wake` is called, in any thread, whenever there is something to take, or the stream is closed.
  void attach(std::function<void()> wake);
  /// Returns all that waits.
  std::string take();

 private:
  void wake();

  mutable std::mutex mutex_;
  std::string waiting_;
  bool is_closed_ = false;
  std::function<void()> wake_, on_gone_;
};

struct HttpRequest {
  std::string method = "GET";
  std::string path = "/";                    ///< decoded; begins with a slash
  std::map<std::string, std::string> query;  ///< decoded; of a name given twice, the last
  std::map<std::string, std::string> headers;  ///< names in small letters
  std::string body;

  /// Empty where there is none.
  const std::string& header(const std::string& name) const;
  const std::string& parameter(const std::string& name) const;
};

struct HttpResponse {
  int status = 200;
  std::string type = "application/json";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers = {};
  /// Given: after the body goes on what is pushed there, until either side ends it.
  std::shared_ptr<EventStream> events = nullptr;
};

/// A request that is refused; the text is one line for people.
class HttpError : public std::runtime_error {
 public:
  HttpError(int status, const std::string& text) : std::runtime_error(text), status_(status) {}
  int status() const { return status_; }

 private:
  int status_;
};

/// {"error": text}, in one line.
HttpResponse errorResponse(int status, const std::string& text);

// The JSON object in a request's body, and its fields. They throw HttpError 400.
nlohmann::json bodyOf(const HttpRequest& request);
/// Returns an empty text where there is none.
std::string textIn(const nlohmann::json& asked, const char* name);
/// Returns false where there is none.
bool flagIn(const nlohmann::json& asked, const char* name);
/// Throws where there is none, unless `otherwise` is given.
double numberIn(const nlohmann::json& asked, const char* name,
                std::optional<double> otherwise = std::nullopt);

/// May be called once, from any thread.
using Respond = std::function<void(HttpResponse)>;
/// Answers a request, at once or later. May be called by several threads at once.
using HttpHandler = std::function<void(const HttpRequest&, const Respond&)>;

/// Takes path and query out of "/api/behaviors?q=pick%20up". Throws HttpError 400 for what is no
/// path, for bad escapes and for NUL.
void readTarget(const std::string& target, HttpRequest& request);

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
