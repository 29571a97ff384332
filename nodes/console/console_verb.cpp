// `afterglow console`: the page and the API of a store, without a ROS master.
#include <poll.h>

#include <CLI/App.hpp>
#include <CLI/Error.hpp>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "nodes/console/behavior_index.hpp"
#include "nodes/console/console_access.hpp"
#include "nodes/console/console_api.hpp"
#include "nodes/console/console_token.hpp"
#include "nodes/console/http_server.hpp"
#include "nodes/console/moment_images.hpp"
#include "nodes/console/picture_settings.hpp"
#include "nodes/tools/stop_signal.hpp"
#include "nodes/verbs/command.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

struct ConsoleOptions {
  std::string store, address = "127.0.0.1", token_file;
  PictureOptions pictures;
  ObserverOptions observer;
  std::uint16_t port = 8080;
  std::vector<std::string> hosts;
};

void waitForSignal() {
  pollfd stop{stopRequestFd(), POLLIN, 0};
  while (!isStopRequested()) poll(&stop, 1, -1);
}

void runConsole(const ConsoleOptions& options) {
  const std::string token = consoleToken(options.address, options.token_file);
  const auto store = replay::openStore(options.store, replay::OpenMode::ReadOnly);
  BehaviorIndex index(*store);
  ConsoleFacts facts;
  facts.version = AFTERGLOW_VERSION;
  facts.store = replay::storeUri(options.store);
  auto desk = openDesk(*store, options.pictures, options.observer);
  if (!desk) facts.why_no_render = "no projector is configured: start the console with --config";
  ConsoleApi api(*store, index, ConsoleAccess(token, options.hosts), facts);
  if (desk) api.setPictures(*desk);
  api.setFile([&desk](const BehaviorDetail& detail) {
    return behaviorPage(detail, desk ? keyImages(detail, *desk) : std::vector<MomentImage>());
  });
  catchStopSignals();
  HttpServer server(
      options.address, options.port,
      [&api](const HttpRequest& request, const Respond& respond) { api.answer(request, respond); });
  std::cout << "the console of " << facts.store << " is at "
            << consoleUrl(options.address, server.port()) << "; Ctrl-C ends it\n";
  if (!token.empty()) std::cout << "token: " << token << "\n";
  std::cout << std::flush;
  waitForSignal();
  server.stop();
  desk.reset();
}

}  // namespace

void addConsoleVerb(CLI::App& app) {
  auto options = std::make_shared<ConsoleOptions>();
  CLI::App* verb = addVerb(app, "console");
  verb->add_option("--port", options->port, "Where the page is; 0: any port that is free")
      ->capture_default_str();
  verb->add_option("--address", options->address,
                   "Which of this machine's addresses listens, in numbers; 0.0.0.0: all. Beyond "
                   "loopback a token is needed to see anything")
      ->capture_default_str();
  verb->add_option("--token-file", options->token_file,
                   "A file whose first line is the token; else $AFTERGLOW_CONSOLE_TOKEN; else, "
                   "beyond loopback, one is made and printed");
  verb->add_option("--host", options->hosts,
                   "A name, too, by which browsers may call this machine; may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  addPictureOptions(*verb, options->pictures);
  addStoreOption(*verb, options->store);
  addObserverOptions(*verb, options->observer);
  verb->callback([options] { runConsole(*options); });
}

}  // namespace afterglow::nodes
