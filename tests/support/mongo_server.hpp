/// \file
/// A server that speaks MongoDB's protocol, for one test program: tests/mongodb/server on a free
/// port, gone when the program ends; or the one that $AFTERGLOW_TEST_MONGODB names.
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include "replay/store/store.hpp"
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
    if (!foreign()) start();
  }
  ~MongoServer() { kill(); }
  MongoServer(const MongoServer&) = delete;
  MongoServer& operator=(const MongoServer&) = delete;

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
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }
  void pause() const { ::kill(pid_, SIGSTOP); }
  void resume() const { ::kill(pid_, SIGCONT); }
  /// Again, on the same port and data.
  void start() {
    pid_ = fork();
    if (pid_ == 0) run();
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!answers()) {
      if (std::chrono::steady_clock::now() > end || waitpid(pid_, nullptr, WNOHANG) == pid_) {
        throw std::runtime_error("tests/mongodb/server does not answer");
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }

 private:
  static const char* foreign() { return std::getenv("AFTERGLOW_TEST_MONGODB"); }

  std::string uriOf(const std::string& database, const std::string& options) const {
    return "mongodb://127.0.0.1:" + std::to_string(port_) + "/" + database + "?" + options;
  }

  static sockaddr_in loopback(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    return address;
  }

  static int freePort() {
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address = loopback(0);
    socklen_t size = sizeof address;
    auto* raw = reinterpret_cast<sockaddr*>(&address);
    if (bind(fd, raw, size) != 0 || getsockname(fd, raw, &size) != 0)
      throw std::runtime_error("no free port");
    close(fd);
    return ntohs(address.sin_port);
  }

  bool answers() const {
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    const sockaddr_in address = loopback(port_);
    const bool is_open =
        connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    close(fd);
    return is_open;
  }

  [[noreturn]] void run() const {
    prctl(PR_SET_PDEATHSIG, SIGKILL);  // a crashed test leaves no server behind
    const int nowhere = open("/dev/null", O_RDWR);
    for (const int fd : {0, 1, 2}) dup2(nowhere, fd);
    const std::string data = folder_.path("");
    execl("tests/mongodb/server", "server", "run", AFTERGLOW_TEST_MONGODB_FOLDER,
          std::to_string(port_).c_str(), data.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }

  TempFolder folder_;
  int port_ = freePort();
  pid_t pid_ = -1;
};

}  // namespace afterglow::test
