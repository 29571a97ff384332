// The console, in two ways: `afterglow console` needs no ROS master; called console_node it is a
// node beside a running robot.
#include <poll.h>
#include <ros/ros.h>

#include <CLI/App.hpp>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "nodes/console/console_node.hpp"
#include "nodes/console/foxglove_live.hpp"
#include "nodes/console/foxglove_server.hpp"
#include "nodes/console/http_server.hpp"
#include "nodes/console/picture_queue.hpp"
#include "nodes/speaker/speech.hpp"
#include "nodes/tools/node_main.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"
#include "nodes/verbs/command.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

constexpr const char* kNodeName = "console_node";
constexpr std::size_t kMostSpoken = 500;  // sentences that are kept

struct ConsoleOptions {
  std::string store, address = "127.0.0.1", token_file;
  std::vector<std::string> hosts, origins;
  PictureOptions pictures;
  std::uint16_t port = 8080;
};

/// The parts that answer, wired together.
class Console {
 public:
  /// `robot`: none without a ROS master. Throws std::runtime_error, one line.
  Console(const ConsoleOptions& options, const std::optional<ConsoleNodeOptions>& robot)
      : options_(options),
        token_(consoleToken(options.address, options.token_file)),
        store_(replay::openStore(options.store, replay::OpenMode::ReadOnly)),
        index_(*store_) {
    index_.begin();
    ConsoleFacts facts{AFTERGLOW_VERSION, replay::storeUri(options.store), ""};
    if (!options.pictures.config.empty()) {
      pictures_.emplace(*store_, readPictureSettings(options.pictures));
    } else if (options.pictures.observer.isGiven()) {
      throw std::runtime_error("pictures need --config");
    } else {
      facts.why_no_render = robot ? "no projector is configured: start console_node with ~config"
                                  : "no projector is configured: start the console with --config";
    }
    const ConsoleAccess access(token_, options.hosts, options.origins);
    foxglove_.emplace(*store_, access);
    api_.emplace(*store_, index_, access, facts);
    if (pictures_) {
      api_->setPictures([this](const PictureRequest& request, const Respond& respond) {
        pictures_->draw(request, [respond](const auto& drawn) { respond(pictureResponse(drawn)); });
      });
    }
    api_->setSpeech([this](const std::string& text) { return spoken(text); });
    api_->setFile([this](const BehaviorDetail& detail) { return fileOf(detail); });
    if (!robot) return;
    node_.emplace(*robot, [this] { return index_.all()->size(); });
    api_->setRobot([this](const HttpRequest& request, const Respond& respond) {
      node_->answer(request, respond);
    });
    foxglove_->setLive([live = std::make_shared<FoxgloveLive>()](const auto& frames) {
      return std::make_shared<FoxgloveLiveSession>(live, frames);
    });
  }

  /// Returns when a stop is requested.
  void serve() {
    HttpServer server(
        options_.address, options_.port,
        [this](const HttpRequest& request, const Respond& respond) {
          api_->answer(request, respond);
        },
        ConsoleApi::isUrgent, {},
        [this](const HttpRequest& request, const std::shared_ptr<FrameQueue>& frames) {
          return foxglove_->open(request, frames);
        });
    std::cout << "the console of " << replay::storeUri(options_.store) << " is at "
              << urlOf("http", server.port()) << "; Ctrl-C ends it\n"
              << "Foxglove and Lichtblick open " << urlOf("ws", server.port()) << "\n";
    if (!token_.empty()) std::cout << "token: " << token_ << "\n";
    std::cout << std::flush;
    pollfd stop{stopRequestFd(), POLLIN, 0};
    while (!isStopRequested()) poll(&stop, 1, -1);
    server.stop();
    if (node_) {
      node_->close();
      ros::shutdown();  // else a player that hangs would keep what waits for its answer
    }
    node_.reset();  // what it was to answer goes before the server
    pictures_.reset();
  }

 private:
  std::string fileOf(const BehaviorDetail& detail) {
    DrawMoment draw;
    if (pictures_) {
      draw = [this, id = detail.behavior.id](PictureView view, double t) {
        return pictures_->drawNow({id, t, view, kPagePictureWidth, "page"});
      };
    }
    return behaviorPage(detail, draw);
  }

  std::string spoken(const std::string& text) {
    const std::lock_guard<std::mutex> lock(speech_mutex_);
    // It keeps each sentence.
    if (!speech_ || ++spoken_ % kMostSpoken == 0)
      speech_.emplace(SpeechOptions{"en-us", 160, "auto"});
    return wavOf(*speech_->say(text));
  }

  /// "http://127.0.0.1:8080/"
  std::string urlOf(const std::string& scheme, std::uint16_t port) const {
    const std::string& address = options_.address;
    const bool is_v6 = address.find(':') != std::string::npos;
    return scheme + "://" + (is_v6 ? "[" + address + "]" : address) + ":" + std::to_string(port) +
           "/";
  }

  const ConsoleOptions options_;
  const std::string token_;
  const std::unique_ptr<replay::Store> store_;
  BehaviorIndex index_;
  std::optional<PictureQueue> pictures_;
  std::optional<FoxgloveServer> foxglove_;
  std::mutex speech_mutex_;       ///< the next two
  std::optional<Speech> speech_;  ///< made for the first sentence
  std::size_t spoken_ = 0;
  std::optional<ConsoleApi> api_;
  std::optional<ConsoleNode> node_;
};

void serveBesideRobot(const ros::NodeHandle& own) {
  ConsoleOptions options;
  own.param("store", options.store, options.store);
  refuseStorePassword(own, options.store);
  own.param("config", options.pictures.config, options.pictures.config);
  own.param("calibration", options.pictures.calibration, options.pictures.calibration);
  own.param("drawn_projector", options.pictures.projector, options.pictures.projector);
  own.param("address", options.address, options.address);
  own.param("token_file", options.token_file, options.token_file);
  own.param("hosts", options.hosts, options.hosts);
  own.param("origins", options.origins, options.origins);
  const int port = own.param("port", int{options.port});
  if (port < 0 || port > UINT16_MAX) throw std::runtime_error("~port is no TCP port");
  options.port = static_cast<std::uint16_t>(port);
  ConsoleNodeOptions robot;
  robot.store = options.store;
  own.param("player", robot.player, robot.player);
  own.param("recorder", robot.recorder, robot.recorder);
  own.param("calibrator", robot.calibrator, robot.calibrator);
  own.param("projector", robot.projector, robot.projector);
  own.param("camera", robot.camera, robot.camera);
  ros::AsyncSpinner spinner(2);
  spinner.start();
  Console console(options, robot);
  boundWaitsForMaster();
  console.serve();
}

void addConsole(CLI::App& app) {
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
  verb->add_option("--origin", options->origins,
                   "A site, too, whose pages may read by the Foxglove protocol, such as "
                   "https://app.foxglove.dev; may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  addPictureOptions(*verb, options->pictures);
  addStoreOption(*verb, options->store);
  verb->callback([options] {
    Console console(*options, std::nullopt);
    catchStopSignals();
    console.serve();
  });
}

}  // namespace
}  // namespace afterglow::nodes

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  if (argc == 3 && std::strcmp(argv[1], DeadManSwitch::kArgument) == 0) {
    return runDeadManSwitch(argv[2]);
  }
  if (std::filesystem::path(argv[0]).filename() != kNodeName) {
    return runCommand(argc, argv, {addConsole});
  }
  const NodeText text{kNodeName, "serves a page to find, look at and replay behaviors.",
                      "console.launch"};
  return runNode(argc, argv, text, [](const auto& own, const auto&) { serveBesideRobot(own); });
}
