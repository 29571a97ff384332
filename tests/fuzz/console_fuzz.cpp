// Whatever comes over the console's port: each input is a connection, whose sender says no more after
// it. The server, the API and a store of one behavior are the console's own.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "nodes/console/console_api.hpp"
#include "nodes/console/foxglove_server.hpp"
#include "nodes/console/http_server.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::fuzz::console_fuzz {
namespace {

using namespace nodes;

std::unique_ptr<replay::Store> storeOfOneBehavior() {
  auto store = replay::openMemoryStore();
  const std::int64_t recording = store->beginImport({});
  const std::int64_t channel = store->addChannel(recording, test::stringChannel("/said"));
  store->append({test::stringMessage(channel, 100, 1, "word")});
  store->addBehavior(test::sampleBehavior(recording, {"/said"}, 0, 700));
  store->finishImport(recording);
  return store;
}

/// Nobody is asked for a token: it would keep most inputs from what is behind it.
struct Console {
  std::unique_ptr<replay::Store> store = storeOfOneBehavior();
  BehaviorIndex index{*store};
  ConsoleApi api{*store, index, ConsoleAccess("", {}), {"1", "a store", "no pictures"}};
  FoxgloveServer foxglove{*store, ConsoleAccess("", {})};
  HttpServer server{
      "127.0.0.1",
      0,
      [this](const HttpRequest& request, const Respond& respond) { api.answer(request, respond); },
      {},
      {},
      [this](const HttpRequest& request, const std::shared_ptr<FrameQueue>& frames) {
        return foxglove.open(request, frames);
      }};

  Console() { index.read(); }
};

sockaddr_in loopback(std::uint32_t host, std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK + host);
  return address;
}

/// Each from an address of its own: connections that have ended keep their ports for a minute. What
/// waits here is interrupted by libFuzzer's alarm and goes on.
int connected(std::uint16_t port) {
  static std::uint32_t host = 0;
  host = (host + 1) % 0xfffff0;
  const int descriptor = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in from = loopback(host, 0), to = loopback(0, port);
  const bool is_connected =
      ::bind(descriptor, reinterpret_cast<const sockaddr*>(&from), sizeof from) == 0 &&
      TEMP_FAILURE_RETRY(
          ::connect(descriptor, reinterpret_cast<const sockaddr*>(&to), sizeof to)) == 0;
  if (!is_connected) {
    throw std::runtime_error(std::string("the console cannot be reached: ") + std::strerror(errno));
  }
  return descriptor;
}

}  // namespace

AFTERGLOW_FUZZ_TARGET(console) {
  static Console* const console = new Console;  // its threads live as long as the process
  const int descriptor = connected(console->server.port());
  ::send(descriptor, data, size, MSG_NOSIGNAL);
  ::shutdown(descriptor, SHUT_WR);
  std::array<char, 4096> answer;
  while (TEMP_FAILURE_RETRY(::recv(descriptor, answer.data(), answer.size(), 0)) > 0) {
  }
  ::close(descriptor);
}

}  // namespace afterglow::fuzz::console_fuzz
