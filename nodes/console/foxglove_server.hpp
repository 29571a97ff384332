/// \file
/// Who may open a WebSocket of the console, and what is behind which address.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "nodes/console/console_access.hpp"
#include "nodes/console/http_message.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Opens WebSockets of the Foxglove protocol: /behavior/TEXT plays the stored behavior that the
/// text selects, as `afterglow play` understands it, from `t` (seconds) on at `rate`; / is the
/// robot, or without one the newest behavior. Any thread.
class FoxgloveServer {
 public:
  using OpenLive =
      std::function<std::shared_ptr<SocketService>(const std::shared_ptr<FrameQueue>& frames)>;

  /// The store has to outlive it, and the services that it opens.
  FoxgloveServer(const replay::Store& store, ConsoleAccess access)
      : store_(store), access_(std::move(access)) {}
  /// To be set before the first open().
  void setLive(OpenLive live) { live_ = std::move(live); }

  /// Answers for HttpServer.
  OpenedSocket open(const HttpRequest& request, const std::shared_ptr<FrameQueue>& frames) const;

 private:
  std::shared_ptr<SocketService> serviceAt(const HttpRequest& request, const std::string& protocol,
                                           const std::shared_ptr<FrameQueue>& frames) const;

  const replay::Store& store_;
  const ConsoleAccess access_;
  OpenLive live_;
};

}  // namespace afterglow::nodes
