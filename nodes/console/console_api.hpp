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

#include "nodes/behavior_view/behavior_page.hpp"
#include "nodes/console/behavior_index.hpp"
#include "nodes/console/console_access.hpp"
#include "nodes/console/http_message.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// The files of the console's page, embedded from assets/console.
struct EmbeddedConsole {
  const char* name;  ///< nullptr ends the list
  const char* text;
};
extern const EmbeddedConsole kEmbeddedConsole[];

/// The console's answer to /api/about.
struct ConsoleFacts {
  std::string version;
  std::string store;          ///< words for people, no password
  std::string why_no_render;  ///< empty: it draws pictures
};

struct PictureRequest {
  std::int64_t behavior = 0;
  double t = 0;  ///< seconds since its begin
  PictureView view = PictureView::Projector;
  int width = kPagePictureWidth;  ///< pixels
  std::string viewer;  ///< of one viewer, behavior and view only the newest request is drawn
  bool at_first_light = false;  ///< its first lit moment is wanted, whatever t is
};

/// Returns at once; responds with a JPEG, or with 404 or 503 {"error"}.
using DrawPicture = std::function<void(const PictureRequest&, const Respond&)>;
/// Speaks a sentence as a WAV file's bytes. Throws std::runtime_error, one line.
using Speak = std::function<std::string(const std::string& text)>;
/// Makes a behavior one file, for /api/behaviors/ID/file.
using MakeFile = std::function<std::string(const BehaviorDetail&)>;

/// Answers at once, in the thread of whoever asks, all but pictures and files; any thread. What it
/// is made of has to outlive it.
class ConsoleApi {
 public:
  ConsoleApi(const replay::Store& store, BehaviorIndex& index, ConsoleAccess access,
             ConsoleFacts facts);
  /// Sets who draws pictures, speaks and makes files; else there are none.
  void setPictures(DrawPicture draw) { draw_ = std::move(draw); }
  void setSpeech(Speak speak) { speak_ = std::move(speak); }
  void setFile(MakeFile make_file) { make_file_ = std::move(make_file); }

  /// Takes the requests that are for a robot: all that is posted but logins, /api/events,
  /// /api/projected, /api/camera and /api/report. Without it there is no robot. To be set before
  /// the first answer().
  void setRobot(HttpHandler robot) { robot_ = std::move(robot); }

  /// Answers for HttpServer.
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
  HttpResponse values(std::int64_t id, const HttpRequest& request) const;
  HttpResponse sound(std::int64_t id, const HttpRequest& request);
  HttpResponse comparison(const HttpRequest& request);
  void picture(std::int64_t id, const HttpRequest& request, const Respond& respond) const;
  HttpResponse file(std::int64_t id);
  std::shared_ptr<const BehaviorDetail> detailOf(std::int64_t id);

  const replay::Store& store_;
  BehaviorIndex& index_;
  ConsoleAccess access_;
  ConsoleFacts facts_;
  BehaviorDetails details_;
  DrawPicture draw_;
  Speak speak_;
  MakeFile make_file_;
  std::mutex file_mutex_;  ///< a file takes seconds of one of the server's threads, not of several
  HttpHandler robot_;
};

}  // namespace afterglow::nodes
