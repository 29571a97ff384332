#include "nodes/tools/time_server.hpp"

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>

namespace afterglow::nodes {
namespace {

constexpr std::size_t kPacketBytes = 48;
constexpr std::size_t kReceivedAt = 32, kSentAt = 40, kOriginAt = 24, kOurTimeAt = 40;
constexpr std::int64_t kUnixEpochIn1900 = 2'208'988'800;  // s
constexpr int kQuestions = 4;

using Packet = std::array<std::uint8_t, kPacketBytes>;
using Addresses = std::unique_ptr<addrinfo, void (*)(addrinfo*)>;

Addresses addressesOf(const std::string& host, std::uint16_t port) {
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &found) != 0) {
    found = nullptr;
  }
  return {found, [](addrinfo* list) {
            if (list) ::freeaddrinfo(list);
          }};
}

class Socket {
 public:
  explicit Socket(const addrinfo& address)
      : fd_(::socket(address.ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() {
    if (fd_ >= 0) ::close(fd_);
  }
  int fd() const { return fd_; }

 private:
  const int fd_;
};

std::int64_t wallNs() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

/// Seconds since 1900 and their 2^32th parts, big endian.
void writeTime(Packet& packet, std::size_t at, std::int64_t ns) {
  const auto seconds = static_cast<std::uint64_t>(ns / 1'000'000'000 + kUnixEpochIn1900);
  const auto rest = static_cast<std::uint64_t>(ns % 1'000'000'000);
  const std::uint64_t time = (seconds << 32U) | ((rest << 32U) / 1'000'000'000U);
  for (std::size_t i = 0; i < 8; ++i) {
    packet[at + i] = static_cast<std::uint8_t>(time >> (56 - 8 * i));
  }
}

std::int64_t readTime(const Packet& packet, std::size_t at) {
  std::uint64_t time = 0;
  for (std::size_t i = 0; i < 8; ++i) time = (time << 8U) | packet[at + i];
  const auto seconds = static_cast<std::int64_t>(time >> 32U) - kUnixEpochIn1900;
  const std::uint64_t parts = time & 0xffffffffU;
  return seconds * 1'000'000'000 + static_cast<std::int64_t>((parts * 1'000'000'000U) >> 32U);
}

/// A server's answer to our question, by a clock that is set.
bool isAnswer(const Packet& answer, const Packet& question) {
  const unsigned leap = answer[0] >> 6U, mode = answer[0] & 7U, stratum = answer[1];
  return leap != 3 && mode == 4 && stratum >= 1 && stratum <= 15 &&
         std::equal(question.begin() + kOurTimeAt, question.end(), answer.begin() + kOriginAt);
}

std::optional<ClockOffset> ask(int fd, double seconds) {
  Packet question{};
  question[0] = (4U << 3U) | 3U;  // version 4, client
  const std::int64_t asked = wallNs();
  writeTime(question, kOurTimeAt, asked);
  if (::send(fd, question.data(), question.size(), 0) < 0) return std::nullopt;
  pollfd waiting{fd, POLLIN, 0};
  if (::poll(&waiting, 1, static_cast<int>(std::lround(seconds * 1000))) <= 0) return std::nullopt;
  Packet answer{};
  const ssize_t count = ::recv(fd, answer.data(), answer.size(), 0);
  const std::int64_t heard = wallNs();
  if (count < static_cast<ssize_t>(answer.size()) || !isAnswer(answer, question)) {
    return std::nullopt;
  }
  const std::int64_t received = readTime(answer, kReceivedAt), sent = readTime(answer, kSentAt);
  const std::int64_t round_trip = (heard - asked) - (sent - received);
  return ClockOffset{((received - asked) + (sent - heard)) / 2,
                     std::max<std::int64_t>(0, round_trip / 2)};
}

}  // namespace

std::optional<ClockOffset> askTimeServer(const std::string& host, double seconds,
                                         std::uint16_t port) {
  const Addresses addresses = addressesOf(host, port);
  if (!addresses) return std::nullopt;
  const Socket socket(*addresses);
  if (::connect(socket.fd(), addresses->ai_addr, addresses->ai_addrlen) != 0) return std::nullopt;
  std::optional<ClockOffset> best;
  for (int i = 0; i < kQuestions; ++i) {
    const auto offset = ask(socket.fd(), seconds / kQuestions);
    if (offset && (!best || offset->at_most_ns < best->at_most_ns)) best = offset;
  }
  return best;
}

bool isThisMachine(const std::string& host) {
  const Addresses addresses = addressesOf(host, 0);
  for (const addrinfo* address = addresses.get(); address; address = address->ai_next) {
    const Socket socket(*address);
    if (::bind(socket.fd(), address->ai_addr, address->ai_addrlen) == 0) return true;
  }
  return false;
}

}  // namespace afterglow::nodes
