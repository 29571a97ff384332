#include "nodes/tools/master_check.hpp"

#include <XmlRpc.h>
#include <ros/network.h>

#include <cstdlib>
#include <stdexcept>
#include <string>

namespace afterglow::nodes {
namespace {

std::string masterUri(int argc, char** argv) {
  const std::string remapping = "__master:=";
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument.rfind(remapping, 0) == 0) return argument.substr(remapping.size());
  }
  const char* uri = std::getenv("ROS_MASTER_URI");
  if (uri == nullptr || *uri == '\0') throw std::runtime_error("ROS_MASTER_URI is not set");
  return uri;
}

}  // namespace

void requireMaster(int argc, char** argv) {
  const std::string uri = masterUri(argc, argv);
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(uri, host, port)) {
    throw std::runtime_error("'" + uri + "' is no ROS master's URI");
  }
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  XmlRpc::XmlRpcValue arguments, result;
  arguments[0] = "/afterglow";
  const bool answers = client.execute("getPid", arguments, result) && !client.isFault();
  client.close();
  if (!answers) throw std::runtime_error("no ROS master at " + uri);
}

}  // namespace afterglow::nodes
