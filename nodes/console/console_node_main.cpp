#include <ros/ros.h>

#include <cstdint>
#include <cstring>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "nodes/console/behavior_index.hpp"
#include "nodes/console/console_api.hpp"
#include "nodes/console/console_node.hpp"
#include "nodes/console/console_token.hpp"
#include "nodes/console/http_server.hpp"
#include "nodes/console/moment_images.hpp"
#include "nodes/console/picture_settings.hpp"
#include "nodes/tools/node_main.hpp"
#include "nodes/tools/stop_signal.hpp"
#include "nodes/tools/store_parameter.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

struct Parameters {
  ConsoleNodeOptions node;
  PictureOptions pictures;
  std::string address = "127.0.0.1", token_file;
  std::vector<std::string> hosts;
  int port = 8080;
};

Parameters readParameters() {
  Parameters all;
  const ros::NodeHandle own("~");
  own.param("store", all.node.store, all.node.store);
  refuseStorePassword(own, all.node.store);
  own.param("player", all.node.player, all.node.player);
  own.param("recorder", all.node.recorder, all.node.recorder);
  own.param("calibrator", all.node.calibrator, all.node.calibrator);
  own.param("projector", all.node.projector, all.node.projector);
  own.param("config", all.pictures.config, all.pictures.config);
  own.param("calibration", all.pictures.calibration, all.pictures.calibration);
  own.param("drawn_projector", all.pictures.projector, all.pictures.projector);
  own.param("address", all.address, all.address);
  own.param("token_file", all.token_file, all.token_file);
  own.param("hosts", all.hosts, all.hosts);
  own.param("port", all.port, all.port);
  if (all.port < 0 || all.port > UINT16_MAX) throw std::runtime_error("~port is no TCP port");
  return all;
}

void serve(const Parameters& given) {
  const std::string token = consoleToken(given.address, given.token_file);
  const auto store = replay::openStore(given.node.store, replay::OpenMode::ReadOnly);
  BehaviorIndex index(*store);
  ConsoleFacts facts;
  facts.version = AFTERGLOW_VERSION;
  facts.store = replay::storeUri(given.node.store);
  auto desk = openDesk(*store, given.pictures);
  if (!desk) facts.why_no_render = "no projector is configured: start console_node with ~config";
  ConsoleApi api(*store, index, ConsoleAccess(token, given.hosts), facts);
  if (desk) api.setPictures(*desk);
  api.setFile([&desk](const BehaviorDetail& detail) {
    return behaviorPage(detail, desk ? keyImages(detail, *desk) : std::vector<MomentImage>());
  });
  ros::AsyncSpinner spinner(2);
  spinner.start();
  auto node = std::make_unique<ConsoleNode>(given.node, *store,
                                            [&index] { return index.all()->size(); });
  api.setRobot([&node](const HttpRequest& request, const Respond& respond) {
    node->answer(request, respond);
  });
  HttpServer server(
      given.address, static_cast<std::uint16_t>(given.port),
      [&api](const HttpRequest& request, const Respond& respond) { api.answer(request, respond); },
      ConsoleApi::isUrgent);
  std::cout << "the console of " << facts.store << " is at "
            << consoleUrl(given.address, server.port()) << "\n";
  if (!token.empty()) std::cout << "token: " << token << "\n";
  std::cout << std::flush;
  waitForStop();
  server.stop();
  node.reset();  // what it was to answer goes before the server
  desk.reset();
}

}  // namespace
}  // namespace afterglow::nodes

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  if (argc == 3 && std::strcmp(argv[1], Farewell::kArgument) == 0) return runFarewell(argv[2]);
  const NodeText text{"console_node", "serves a page to find, look at and replay behaviors.",
                      "console.launch"};
  return runNode(argc, argv, text, [](const auto&...) { serve(readParameters()); });
}
