/// \file
/// The console's API: routes and their answers, apart from sockets. README.md beside this documents
/// it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "nodes/console/behavior_index.hpp"
#include "nodes/console/console_access.hpp"
#include "nodes/console/http_message.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// What the console is, for /api/about.
struct ConsoleFacts {
  std::string version;
  std::string store;          ///< in words, no password
  std::string why_no_render;  ///< empty: it draws pictures
};

/// Answers at once, in the thread of whoever asks; any thread. What it is made of has to outlive
/// it.
class ConsoleApi {
 public:
  ConsoleApi(const replay::Store& store, BehaviorIndex& index, ConsoleAccess access,
             ConsoleFacts facts);

  /// Who answers what is asked of a robot: all that is posted but logins, /api/events and
  /// /api/projected. Without, there is none. To be set before the first answer().
  void setRobot(HttpHandler robot) { robot_ = std::move(robot); }

  /// For HttpServer.
  void answer(const HttpRequest& request, const Respond& respond);

 private:
  HttpResponse answerNow(const HttpRequest& request);
  bool isRobots(const HttpRequest& request) const;
  HttpResponse about() const;
  HttpResponse behaviors(const HttpRequest& request) const;
  HttpResponse calendar() const;

  const replay::Store& store_;
  BehaviorIndex& index_;
  ConsoleAccess access_;
  ConsoleFacts facts_;
  HttpHandler robot_;
};

}  // namespace afterglow::nodes
