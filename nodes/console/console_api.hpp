/// \file
/// The console's API: routes and their answers, apart from sockets. README.md beside this documents
/// it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "nodes/console/behavior_detail.hpp"
#include "nodes/console/behavior_index.hpp"
#include "nodes/console/console_access.hpp"
#include "nodes/console/http_message.hpp"
#include "nodes/console/picture_source.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// What the console is, for /api/about.
struct ConsoleFacts {
  std::string version;
  std::string store;          ///< in words, no password
  std::string why_no_render;  ///< empty: it draws pictures
};

/// A behavior as one file, for /api/behaviors/ID/file.
using MakeFile = std::function<std::string(const BehaviorDetail&)>;

/// Answers at once, in the thread of whoever asks, all but pictures and files; any thread. What it
/// is made of has to outlive it.
class ConsoleApi {
 public:
  ConsoleApi(const replay::Store& store, BehaviorIndex& index, ConsoleAccess access,
             ConsoleFacts facts);
  /// Without them there are no pictures, and no files.
  void setPictures(PictureSource& pictures) { pictures_ = &pictures; }
  void setFile(MakeFile make_file) { make_file_ = std::move(make_file); }

  /// Who answers what is asked of a robot: all that is posted but logins, /api/events,
  /// /api/projected and /api/report. Without, there is none. To be set before the first answer().
  void setRobot(HttpHandler robot) { robot_ = std::move(robot); }

  /// For HttpServer.
  void answer(const HttpRequest& request, const Respond& respond);
  /// Stops, and signs of life of who holds the button: they wait for nobody.
  static bool isUrgent(const HttpRequest& request) {
    return request.path == "/api/stop" || request.path == "/api/hold";
  }

 private:
  void answerOrThrow(const HttpRequest& request, const Respond& respond);
  HttpResponse answerNow(const HttpRequest& request);
  void answerOf(std::int64_t id, const std::string& part, const HttpRequest& request,
                const Respond& respond);
  static bool isRobots(const HttpRequest& request);
  HttpResponse about() const;
  HttpResponse behaviors(const HttpRequest& request) const;
  HttpResponse calendar() const;
  HttpResponse message(std::int64_t id, const HttpRequest& request) const;
  HttpResponse comparison(const HttpRequest& request);
  void picture(std::int64_t id, const HttpRequest& request, const Respond& respond) const;
  HttpResponse file(std::int64_t id);

  const replay::Store& store_;
  BehaviorIndex& index_;
  ConsoleAccess access_;
  ConsoleFacts facts_;
  BehaviorDetails details_;
  PictureSource* pictures_ = nullptr;
  MakeFile make_file_;
  std::mutex file_mutex_;  ///< a file takes seconds of one of the server's threads, not of several
  HttpHandler robot_;
};

}  // namespace afterglow::nodes
