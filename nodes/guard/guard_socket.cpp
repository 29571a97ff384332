#include "nodes/guard/guard_socket.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace afterglow {
namespace nodes {

GuardSocket::~GuardSocket() { ::close(fd_); }

std::pair<int, int> GuardSocket::makePair() {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) {
    throw std::system_error(errno, std::generic_category(), "no line to the watchdog");
  }
  return {ends[0], ends[1]};
}

void GuardSocket::sendPacket(const Packet& packet) {
  const ssize_t sent = ::send(fd_, packet.data(), packet.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  is_closed_ = is_closed_ || (sent < 0 && errno != EAGAIN && errno != EINTR);
}

GuardSocket::Packet GuardSocket::receive() {
  const ssize_t size = ::recv(fd_, nullptr, 0, MSG_PEEK | MSG_TRUNC | MSG_DONTWAIT);
  if (size <= 0) {
    is_closed_ = is_closed_ || size == 0 || (errno != EAGAIN && errno != EINTR);
    return {};
  }
  Packet packet(static_cast<std::size_t>(size));
  ::recv(fd_, packet.data(), packet.size(), MSG_DONTWAIT);
  return packet;
}

void GuardSocket::wait(int timeout_ms, int other_fd) const {
  // An end that has been seen is no news.
  pollfd polled[] = {{is_closed_ ? -1 : fd_, POLLIN, 0}, {other_fd, POLLIN, 0}};
  ::poll(polled, 2, timeout_ms);
}

}  // namespace nodes
}  // namespace afterglow
