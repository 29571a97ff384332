#include "nodes/console/http_server.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <list>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "replay/messages/text.hpp"

namespace afterglow::nodes {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace websocket = boost::beast::websocket;
using Tcp = asio::ip::tcp;
using boost::system::error_code;

constexpr std::pair<const char*, const char*> kSafeHeaders[] = {
    {"X-Content-Type-Options", "nosniff"},
    {"Referrer-Policy", "no-referrer"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Content-Security-Policy",
     "default-src 'self'; img-src 'self' data: blob:; style-src 'self'; script-src 'self'; "
     "base-uri 'none'; form-action 'self'; frame-ancestors 'none'"}};

/// Time after which a client that acknowledges nothing is gone: a cable that was pulled.
constexpr unsigned kUnacknowledgedMs = 2000;
/// Threads for connections, and for what is urgent.
constexpr int kConnectionThreads = 2;

std::string textOf(const beast::string_view& view) { return {view.data(), view.size()}; }

/// Throws HttpError for headers that two readers could understand in two ways.
HttpRequest requestOf(const http::request<http::string_body>& message) {
  HttpRequest request;
  request.method = textOf(message.method_string());
  for (const auto& field : message) {
    const std::string name = replay::lowerCase(textOf(field.name_string()));
    const auto [at, is_new] = request.headers.emplace(name, textOf(field.value()));
    const bool is_single = name == "host" || name == "origin" || name == "authorization";
    if (!is_new && is_single) throw HttpError(400, "there are two headers " + name);
    if (!is_new) at->second += (name == "cookie" ? "; " : ", ") + textOf(field.value());
  }
  readTarget(textOf(message.target()), request);
  request.body = message.body();
  return request;
}

/// Returns the answer to a request that could not be read; empty: the client is gone, or too slow.
std::optional<HttpResponse> responseTo(const error_code& error) {
  if (error == http::error::header_limit) return errorResponse(431, "the headers are too long");
  if (error == http::error::body_limit) return errorResponse(413, "the request is too long");
  if (error == http::error::end_of_stream || error == http::error::partial_message) return {};
  const bool is_malformed = error.category() == make_error_code(http::error::bad_method).category();
  return is_malformed ? std::optional(errorResponse(400, "this is no HTTP")) : std::nullopt;
}

/// The things that sessions share. Lives until the last of them is gone.
struct HttpShared {
  HttpHandler handler;
  std::function<bool(const HttpRequest&)> is_urgent;
  OpenSocket open_socket;
  HttpLimits limits;
  std::atomic<std::size_t> streams{0};
  asio::thread_pool workers;  ///< threads for what is not urgent

  explicit HttpShared(int threads) : workers(static_cast<std::size_t>(threads)) {}
};

/// A WebSocket that was granted. Keeps itself alive until the connection ends; in its stream's
/// strand. Counts as one of the streams, which whoever makes it has counted.
class SocketSession : public std::enable_shared_from_this<SocketSession> {
 public:
  SocketSession(beast::tcp_stream stream, std::shared_ptr<HttpShared> shared, OpenedSocket opened,
                std::shared_ptr<FrameQueue> frames)
      : socket_(std::move(stream)),
        shared_(std::move(shared)),
        opened_(std::move(opened)),
        frames_(std::move(frames)) {}
  SocketSession(const SocketSession&) = delete;
  SocketSession& operator=(const SocketSession&) = delete;
  ~SocketSession() {
    frames_->close();
    --shared_->streams;
    // Its end may wait for threads of its own: no matter for a thread that answers what is urgent.
    asio::post(shared_->workers,
               [service = std::move(opened_.service)]() mutable { service.reset(); });
  }

  void accept(const http::request<http::string_body>& request) {
    beast::get_lowest_layer(socket_).expires_never();
    socket_.set_option(websocket::stream_base::timeout{shared_->limits.header_patience,
                                                       shared_->limits.patience, true});
    socket_.set_option(websocket::stream_base::decorator(
        [protocol = opened_.protocol](websocket::response_type& response) {
          response.set(http::field::sec_websocket_protocol, protocol);
        }));
    socket_.read_message_max(shared_->limits.body_bytes);
    socket_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (error) return;
      self->read();
      // What is pushed keeps no connection alive: read() does, until it ends.
      self->frames_->attach([weak = self->weak_from_this()] {
        const auto session = weak.lock();
        if (!session) return;
        asio::post(session->socket_.get_executor(), [session] { session->pass(); });
      });
    });
  }

 private:
  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) return self->frames_->close();
      SocketFrame frame{self->socket_.got_text(), beast::buffers_to_string(self->buffer_.data())};
      self->buffer_.consume(self->buffer_.size());
      asio::post(self->shared_->workers, [self, frame = std::move(frame)] { self->handle(frame); });
    });
  }

  /// Runs in a worker: the next frame is read when this one was taken.
  void handle(const SocketFrame& frame) {
    try {
      opened_.service->take(frame);
    } catch (const std::exception&) {
      return frames_->close();
    }
    asio::post(socket_.get_executor(), [self = shared_from_this()] { self->read(); });
  }

  void pass() {
    if (frames_->isClosed()) return beast::get_lowest_layer(socket_).close();
    if (is_passing_) return;
    auto frame = frames_->take();
    if (!frame) return;
    is_passing_ = true;
    passing_ = std::move(frame->bytes);
    socket_.text(frame->is_text);
    socket_.async_write(asio::buffer(passing_),
                        [self = shared_from_this()](error_code error, std::size_t) {
                          self->is_passing_ = false;
                          error ? self->frames_->close() : self->pass();
                        });
  }

  websocket::stream<beast::tcp_stream> socket_;
  std::shared_ptr<HttpShared> shared_;
  OpenedSocket opened_;
  std::shared_ptr<FrameQueue> frames_;
  beast::flat_buffer buffer_;
  std::string passing_;
  bool is_passing_ = false;
};

/// A connection. Keeps itself alive while something is under way; in its stream's strand.
class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(Tcp::socket socket, std::shared_ptr<HttpShared> shared)
      : stream_(std::move(socket)), shared_(std::move(shared)) {}
  HttpSession(const HttpSession&) = delete;
  HttpSession& operator=(const HttpSession&) = delete;
  ~HttpSession() {
    if (events_) --shared_->streams;
  }

  void start() {
    asio::dispatch(stream_.get_executor(), [self = shared_from_this()] { self->awaitRequest(); });
  }
  /// Returns true if it is idle, or slow to ask or to take its answer. Any thread.
  bool awaitsClient() const { return awaits_client_; }
  /// Any thread.
  void close() {
    asio::post(stream_.get_executor(), [self = shared_from_this()] { self->stream_.close(); });
  }

 private:
  void awaitRequest() {
    parser_.emplace();
    parser_->header_limit(static_cast<std::uint32_t>(shared_->limits.header_bytes));
    parser_->body_limit(shared_->limits.body_bytes);
    awaits_client_ = true;
    if (buffer_.size() > 0) return readHeader();
    constexpr std::size_t kPart = 4096;
    stream_.expires_after(shared_->limits.patience);
    stream_.async_read_some(buffer_.prepare(kPart),
                            [self = shared_from_this()](error_code error, std::size_t size) {
                              if (error) return;
                              self->buffer_.commit(size);
                              self->readHeader();
                            });
  }

  void readHeader() {
    stream_.expires_after(shared_->limits.header_patience);
    http::async_read_header(stream_, buffer_, *parser_,
                            [self = shared_from_this()](error_code error, std::size_t) {
                              error ? self->refuse(error) : self->readBody();
                            });
  }

  void readBody() {
    stream_.expires_after(shared_->limits.patience);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](error_code error, std::size_t) {
                       error ? self->refuse(error) : self->answer();
                     });
  }

  void refuse(const error_code& error) {
    if (auto response = responseTo(error)) write(std::move(*response), false);
  }

  void answer() {
    awaits_client_ = false;
    http::request<http::string_body> message = parser_->release();
    const bool keeps_alive = message.keep_alive();
    // Dropped unused, by whoever should have answered: the connection is closed with it.
    const Respond respond = [self = shared_from_this(), keeps_alive](HttpResponse response) {
      asio::post(self->stream_.get_executor(),
                 [self, keeps_alive, response = std::move(response)]() mutable {
                   self->write(std::move(response), keeps_alive);
                 });
    };
    try {
      HttpRequest request = requestOf(message);
      if (shared_->is_urgent && shared_->is_urgent(request)) return handle(request, respond);
      if (shared_->open_socket && websocket::is_upgrade(message)) {
        if (buffer_.size() > 0) throw HttpError(400, "frames came before the handshake's end");
        return openSocket(std::move(request), std::move(message), respond);
      }
      asio::post(shared_->workers, [self = shared_from_this(), request = std::move(request),
                                    respond] { self->handle(request, respond); });
    } catch (const HttpError& refused) {
      respond(errorResponse(refused.status(), refused.what()));
    }
  }

  void handle(const HttpRequest& request, const Respond& respond) const {
    respondToErrors(respond, [&] { shared_->handler(request, respond); });
  }

  /// The request goes on as a WebSocket, or is refused.
  void openSocket(HttpRequest request, http::request<http::string_body> message,
                  const Respond& respond) {
    const auto open = [this, message, respond](const HttpRequest& asked) {
      const auto frames = std::make_shared<FrameQueue>();
      const OpenedSocket opened = shared_->open_socket(asked, frames);
      asio::post(
          stream_.get_executor(), [self = shared_from_this(), message, opened, frames, respond] {
            if (++self->shared_->streams > self->shared_->limits.streams) {
              --self->shared_->streams;
              return respond(errorResponse(503, "too many connections are open: close one"));
            }
            std::make_shared<SocketSession>(std::move(self->stream_), self->shared_, opened, frames)
                ->accept(message);
          });
    };
    asio::post(shared_->workers, [self = shared_from_this(), request = std::move(request), open,
                                  respond] { respondToErrors(respond, [&] { open(request); }); });
  }

  template <typename Work>
  static void respondToErrors(const Respond& respond, const Work& work) {
    try {
      work();
    } catch (const HttpError& refused) {
      respond(errorResponse(refused.status(), refused.what()));
    } catch (const std::exception& failure) {
      respond(errorResponse(500, failure.what()));
    }
  }

  void write(HttpResponse response, bool keeps_alive) {
    if (response.events && ++shared_->streams > shared_->limits.streams) {
      --shared_->streams;
      response.events->close();
      response = errorResponse(503, "too many pages are open: close one, and load this one again");
    }
    awaits_client_ = !response.events;
    message_ = {};
    message_.version(11);
    message_.result(static_cast<unsigned>(response.status));
    for (const auto& [name, value] : kSafeHeaders) message_.set(name, value);
    message_.set(http::field::cache_control, "no-store");
    if (!response.type.empty()) message_.set(http::field::content_type, response.type);
    for (const auto& [name, value] : response.headers) message_.set(name, value);
    message_.keep_alive(keeps_alive);
    message_.body() = std::move(response.body);
    stream_.expires_after(shared_->limits.patience);
    if (response.events) return stream(std::move(response.events));
    message_.prepare_payload();
    http::async_write(stream_, message_,
                      [self = shared_from_this(), keeps_alive](error_code error, std::size_t) {
                        if (!error && keeps_alive) return self->awaitRequest();
                        error_code ignored;
                        self->stream_.socket().shutdown(Tcp::socket::shutdown_send, ignored);
                      });
  }

  /// Sends events without a length: they end with the connection.
  void stream(std::shared_ptr<EventStream> events) {
    events_ = std::move(events);
    message_.keep_alive(false);
    const int descriptor = stream_.socket().native_handle();
    ::setsockopt(descriptor, IPPROTO_TCP, TCP_USER_TIMEOUT, &kUnacknowledgedMs,
                 sizeof kUnacknowledgedMs);
    const auto self = shared_from_this();
    http::async_write(stream_, message_, [self](error_code error, std::size_t) {
      if (error && error != http::error::end_of_stream) return self->events_->close();
      self->stream_.expires_never();
      self->awaitEnd();
      // What is pushed keeps no connection alive: awaitEnd() does, until it ends.
      self->events_->attach([weak = self->weak_from_this()] {
        const auto session = weak.lock();
        if (!session) return;
        asio::post(session->stream_.get_executor(), [session] { session->pass(); });
      });
    });
  }

  /// Nothing more is to come from the client; what comes is not looked at.
  void awaitEnd() {
    stream_.async_read_some(asio::buffer(ignored_),
                            [self = shared_from_this()](error_code error, std::size_t) {
                              error ? self->events_->close() : self->awaitEnd();
                            });
  }

  void pass() {
    if (events_->isClosed()) return stream_.close();
    if (!passing_.empty()) return;
    passing_ = events_->take();
    if (passing_.empty()) return;
    asio::async_write(stream_, asio::buffer(passing_),
                      [self = shared_from_this()](error_code error, std::size_t) {
                        self->passing_.clear();
                        error ? self->events_->close() : self->pass();
                      });
  }

  beast::tcp_stream stream_;
  std::shared_ptr<HttpShared> shared_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  http::response<http::string_body> message_;
  std::shared_ptr<EventStream> events_;  ///< stream of a response that goes on
  std::string passing_;
  std::array<char, 256> ignored_{};
  std::atomic<bool> awaits_client_{true};
};

}  // namespace

struct HttpServer::Impl {
  Impl(const std::string& address, std::uint16_t port, HttpHandler handler,
       std::function<bool(const HttpRequest&)> is_urgent, HttpLimits limits, OpenSocket open_socket)
      : shared(std::make_shared<HttpShared>(limits.threads)),
        io(kConnectionThreads),
        acceptor(asio::make_strand(io)) {
    shared->handler = std::move(handler);
    shared->is_urgent = std::move(is_urgent);
    shared->limits = limits;
    shared->open_socket = std::move(open_socket);
    error_code error;
    const auto ip = asio::ip::make_address(address, error);
    if (error) throw std::runtime_error("'" + address + "' is no IP address");
    const Tcp::endpoint endpoint(ip, port);
    acceptor.open(endpoint.protocol(), error);
    if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (error) {
      throw std::runtime_error("cannot listen on " + address + ", port " + std::to_string(port) +
                               ": " + error.message());
    }
    accept();
    for (int i = 0; i < kConnectionThreads; ++i) threads.emplace_back([this] { io.run(); });
  }

  ~Impl() { stop(); }

  void stop() {
    io.stop();
    for (std::thread& thread : threads) thread.join();
    threads.clear();
    shared->workers.stop();
    shared->workers.join();
  }

  /// Returns true if there is room for one more, perhaps in the place of another one. Runs in the
  /// acceptor's strand.
  bool makeRoom() {
    sessions.remove_if([](const auto& session) { return session.expired(); });
    if (sessions.size() < shared->limits.connections) return true;
    for (auto at = sessions.begin(); at != sessions.end(); ++at) {
      const auto session = at->lock();
      if (session && !session->awaitsClient()) continue;
      if (session) session->close();
      sessions.erase(at);
      return true;
    }
    return false;
  }

  void accept() {
    acceptor.async_accept(asio::make_strand(io), [this](error_code error, Tcp::socket socket) {
      if (!error && makeRoom()) {
        const auto session = std::make_shared<HttpSession>(std::move(socket), shared);
        sessions.push_back(session);
        session->start();
      }
      if (error == asio::error::operation_aborted) return;
      if (error) std::this_thread::sleep_for(std::chrono::milliseconds(20));  // no descriptors left
      accept();
    });
  }

  std::shared_ptr<HttpShared> shared;
  asio::io_context io;
  Tcp::acceptor acceptor;
  std::list<std::weak_ptr<HttpSession>> sessions;  ///< the oldest first; in the acceptor's strand
  std::vector<std::thread> threads;
};

HttpServer::HttpServer(const std::string& address, std::uint16_t port, HttpHandler handler,
                       std::function<bool(const HttpRequest&)> is_urgent, HttpLimits limits,
                       OpenSocket open_socket)
    : impl_(std::make_unique<Impl>(address, port, std::move(handler), std::move(is_urgent), limits,
                                   std::move(open_socket))) {}

HttpServer::~HttpServer() = default;

void HttpServer::stop() { impl_->stop(); }

std::uint16_t HttpServer::port() const { return impl_->acceptor.local_endpoint().port(); }

}  // namespace afterglow::nodes
