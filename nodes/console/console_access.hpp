/// \file
/// The check of who may use the console.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nodes/console/http_message.hpp"

namespace afterglow::nodes {

/// Returns true if an IP address in numbers is this machine's own, 127.0.0.0/8 or ::1.
bool isLoopback(const std::string& address);

/// Returns a file's first line, else $AFTERGLOW_CONSOLE_TOKEN, else, beyond loopback, a token that
/// is made; an empty one where no token is needed. Throws std::runtime_error, one line, for one
/// that is too short or has what headers cannot hold.
std::string consoleToken(const std::string& address, const std::string& token_file);

/// Decides on every request, before it is looked at any further.
///
/// A Host header has to be an IP address, localhost, this machine's name (also with .local) or a
/// name that is given: a foreign name that was pointed at this machine (DNS rebinding) is refused.
/// A POST has to be JSON and to come from a page of this server, or from no page. With a token, all
/// of /api/ needs it but the login: as "Authorization: Bearer TOKEN", or as the cookie that the
/// login sets. Tokens are compared in constant time.
class ConsoleAccess {
 public:
  /// No token: whoever reaches the server may use it. `origins`: other sites, as browsers name
  /// them ("https://app.foxglove.dev"), whose pages may open a WebSocket.
  ConsoleAccess(std::string token, std::vector<std::string> hosts,
                std::vector<std::string> origins = {});

  bool needsToken() const { return !token_.empty(); }
  /// Nothing: the request may go on. Else 400, 401, 403 or 415.
  std::optional<HttpResponse> refusal(const HttpRequest& request) const;
  /// Likewise for a WebSocket, which browsers open for pages of any site: a page has to be of this
  /// server, of a site that is given or of this machine's disk (desktop programs), or to know the
  /// token. Tools that can set no header give it as the parameter `token` of the address.
  std::optional<HttpResponse> socketRefusal(const HttpRequest& request) const;
  /// The answer to POST /api/login {"token": T}.
  HttpResponse login(const HttpRequest& request) const;

 private:
  bool isKnownHost(const std::string& host) const;
  bool isToken(const std::string& text) const;
  bool hasTokenHeader(const HttpRequest& request) const;

  std::string token_;
  std::vector<std::string> hosts_, origins_;
};

}  // namespace afterglow::nodes
