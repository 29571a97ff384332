/// \file
/// Requests and responses as values: routes are tested without sockets.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace afterglow::nodes {

class EventStream;

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

/// May be called once, from any thread.
using Respond = std::function<void(HttpResponse)>;
/// Answers a request, at once or later. May be called by several threads at once.
using HttpHandler = std::function<void(const HttpRequest&, const Respond&)>;

/// Takes path and query out of "/api/behaviors?q=pick%20up". Throws HttpError 400 for what is no
/// path, for bad escapes and for NUL.
void readTarget(const std::string& target, HttpRequest& request);

}  // namespace afterglow::nodes
