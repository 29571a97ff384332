/// \file
/// The link between a player and its watchdog: a socket that keeps messages whole and shows either
/// side when the other is gone. Messages are JSON objects with a "kind", as CBOR:
/// - player to guard: output {topic, type, md5, definition, stop, may_be_unheard}, ready?, beat
///   {moving, patience_ns, sent_ns (replay::sinceBoot())}, stop, end;
/// - guard to player: ready {unheard}, beat (one for each it heard), braking {reason}.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

namespace afterglow::nodes {

/// Owns its file descriptor. Never blocks; one thread at a time.
class GuardLink {
 public:
  explicit GuardLink(int fd) : fd_(fd) {}
  ~GuardLink();
  GuardLink(const GuardLink&) = delete;
  GuardLink& operator=(const GuardLink&) = delete;

  /// Two ends, closed on exec. Throws std::system_error.
  static std::pair<int, int> makePair();

  /// False if the other side is gone, or has not read for long.
  bool send(const nlohmann::json& message);
  /// Empty: none has come yet, or the other side is gone.
  std::optional<nlohmann::json> receive();
  /// Waits for something to receive, the other side's end, or something to read at `other_fd` (-1:
  /// nothing).
  void wait(int timeout_ms, int other_fd = -1) const;
  bool isClosed() const { return is_closed_; }
  int fd() const { return fd_; }

 private:
  int fd_;
  bool is_closed_ = false;
};

}  // namespace afterglow::nodes
