#include "nodes/kitting/bystander.hpp"

#include <XmlRpcClient.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <std_msgs/String.h>

#include <filesystem>

#include "nodes/kitting/kitting_robot.hpp"
#include "nodes/kitting/media.hpp"

namespace afterglow::nodes {
namespace {

constexpr const char* kObserver = "/observer_node";
constexpr double kLastFrames = 30;  // seconds that the encoder may need for what is left

std_msgs::String text(const std::string& data) {
  std_msgs::String message;
  message.data = data;
  return message;
}

// As `rosnode kill` does it: the node finishes its film and ends.
void endNode(const std::string& name) {
  XmlRpc::XmlRpcValue request, response, payload;
  request[0] = ros::this_node::getName();
  request[1] = name;
  if (!ros::master::execute("lookupNode", request, response, payload, false)) {
    throw TaskError(name + " is not there any more");
  }
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(payload, host, port)) {
    throw TaskError(name + " cannot be reached at " + std::string(payload));
  }
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  XmlRpc::XmlRpcValue arguments, answer;
  arguments[0] = ros::this_node::getName();
  arguments[1] = "the film is over";
  client.execute("shutdown", arguments, answer);
}

}  // namespace

Bystander::Bystander(const BystanderFiles& files)
    : files_(files),
      look_(node_.advertise<std_msgs::String>(std::string(kObserver) + "/look", 10)),
      caption_(node_.advertise<std_msgs::String>(std::string(kObserver) + "/caption", 10)),
      key_frame_(node_.advertise<std_msgs::String>(std::string(kObserver) + "/key_frame", 10)) {}

void Bystander::waitUntilReady(double seconds) {
  const ros::WallTime deadline = ros::WallTime::now() + ros::WallDuration(seconds);
  for (const ros::Publisher* publisher : {&look_, &caption_, &key_frame_}) {
    while (publisher->getNumSubscribers() == 0) {
      if (ros::WallTime::now() > deadline) {
        throw TaskError("observer_node is not there: nobody listens to " + publisher->getTopic());
      }
      sleepFor(0.02);
    }
  }
}

void Bystander::look(const std::string& place) { look_.publish(text(place)); }

void Bystander::caption(const std::string& tag, const std::string& words) {
  caption_.publish(text(tag + "|" + words));
}

void Bystander::takePicture(const std::string& name) { key_frame_.publish(text(name)); }

void Bystander::finish(const std::string& video) {
  endNode(kObserver);
  const ros::WallTime deadline = ros::WallTime::now() + ros::WallDuration(kLastFrames);
  const std::string finished = files_.silent_video + ".json";
  while (!std::filesystem::exists(finished)) {
    if (ros::WallTime::now() > deadline) {
      throw TaskError("observer_node did not finish " + files_.silent_video);
    }
    sleepFor(0.05);
  }
  addSpeech(files_.silent_video, files_.speech_log, video);
}

}  // namespace afterglow::nodes
