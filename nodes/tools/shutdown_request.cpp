/// \file
/// The part of stop_signal.hpp that knows ROS.
#include <ros/ros.h>
#include <ros/xmlrpc_manager.h>

#include <chrono>
#include <thread>

#include "nodes/tools/stop_signal.hpp"

namespace afterglow {
namespace nodes {

void catchShutdownRequests() {
  // The first binding of a name stays: ros::start() does not replace this one.
  ros::XMLRPCManager::instance()->bind("shutdown",
                                       [](XmlRpc::XmlRpcValue&, XmlRpc::XmlRpcValue& answer) {
                                         noteShutdownRequest();
                                         answer = ros::xmlrpc::responseInt(1, "", 0);
                                       });
}

void waitForStop() {
  while (ros::ok() && !isStopRequested()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

void letMessagesLeave() {
  if (ros::ok()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
}

}  // namespace nodes
}  // namespace afterglow
