#include "nodes/player/guard_link.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <vector>

namespace afterglow::nodes {

using nlohmann::json;

GuardLink::~GuardLink() { ::close(fd_); }

std::pair<int, int> GuardLink::makePair() {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) {
    throw std::system_error(errno, std::generic_category(), "no line to the watchdog");
  }
  return {ends[0], ends[1]};
}

bool GuardLink::send(const json& message) {
  const std::vector<std::uint8_t> bytes = json::to_cbor(message);
  return ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT) ==
         static_cast<ssize_t>(bytes.size());
}

std::optional<json> GuardLink::receive() {
  const ssize_t size = ::recv(fd_, nullptr, 0, MSG_PEEK | MSG_TRUNC | MSG_DONTWAIT);
  if (size <= 0) {
    is_closed_ = is_closed_ || size == 0 || (errno != EAGAIN && errno != EINTR);
    return std::nullopt;
  }
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
  ::recv(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT);
  return json::from_cbor(bytes);
}

void GuardLink::wait(int timeout_ms, int other_fd) const {
  pollfd polled[] = {{fd_, POLLIN, 0}, {other_fd, POLLIN, 0}};
  ::poll(polled, 2, timeout_ms);
}

}  // namespace afterglow::nodes
