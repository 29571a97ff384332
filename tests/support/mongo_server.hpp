/// \file
/// A server that speaks MongoDB's protocol, for one test program: tests/mongodb/server on a free
/// port, gone when the program ends; or the one that $AFTERGLOW_TEST_MONGODB names.
#pragma once

#include <cstdlib>
#include <fstream>
#include <optional>
#include <string>

#include "replay/store/store.hpp"
#include "tests/support/own_server.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::test {

class MongoServer {
 public:
  /// Why there is none to test with; empty if there is one.
  static std::optional<std::string> absence() {
    const std::string folder = AFTERGLOW_TEST_MONGODB_FOLDER;
    if (std::ifstream why(folder + "/absent"); why) {
      std::string line;
      std::getline(why, line);
      return line;
    }
    return std::nullopt;
  }

  MongoServer() {
    if (foreign()) return;
    server_.emplace(
        std::vector<std::string>{"tests/mongodb/server", "run", AFTERGLOW_TEST_MONGODB_FOLDER,
                                 std::to_string(port_), folder_.path("")},
        port_, SIGKILL);
  }

  /// A database that nobody else has, on this server.
  std::string uri(const std::string& options = "") const {
    const std::string database = "t" + replay::newKey();
    if (!foreign()) return uriOf(database, options);
    std::string uri = foreign();
    const auto question = uri.find('?');
    const std::string tail = question == std::string::npos ? "?" : uri.substr(question) + "&";
    uri = uri.substr(0, question);
    const auto path = uri.find('/', uri.find("://") + 3);
    return uri.substr(0, path) + "/" + database + tail + options;
  }
  /// True if this program started it and may stop it.
  bool isOwn() const { return !foreign(); }

  /// As kill -9 does.
  void kill() {
    if (server_) server_->end();
  }
  void pause() const { server_->signal(SIGSTOP); }
  void resume() const { server_->signal(SIGCONT); }
  /// Again, on the same port and data.
  void start() { server_->start(); }

 private:
  static const char* foreign() { return std::getenv("AFTERGLOW_TEST_MONGODB"); }

  std::string uriOf(const std::string& database, const std::string& options) const {
    return "mongodb://127.0.0.1:" + std::to_string(port_) + "/" + database + "?" + options;
  }

  TempFolder folder_;
  int port_ = freePort();
  std::optional<OwnServer> server_;  ///< none where $AFTERGLOW_TEST_MONGODB names another
};

}  // namespace afterglow::test
