#include "nodes/player/ros_clock.hpp"

#include <rosgraph_msgs/Clock.h>

#include <chrono>
#include <cmath>
#include <utility>

#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

constexpr const char* kClockTopic = "/clock";

}  // namespace

std::string clockPublisher() {
  const auto others = askMaster(deadlineIn(kMasterPatience)).otherPublishers(kClockTopic);
  return others.empty() ? "" : *others.begin();
}

ClockGiver::ClockGiver(double hz, std::function<replay::Stamp()> time)
    : publisher_(node_.advertise<rosgraph_msgs::Clock>(kClockTopic, 1, true)),
      thread_([this, hz, time = std::move(time)] {
        const std::chrono::nanoseconds period(std::llround(1e9 / hz));
        auto next = std::chrono::steady_clock::now();
        while (!is_over_) {
          rosgraph_msgs::Clock message;
          message.clock.fromNSec(static_cast<std::uint64_t>(time().ns));
          publisher_.publish(message);
          next += period;
          std::this_thread::sleep_until(next);
        }
      }) {}

ClockGiver::~ClockGiver() {
  is_over_ = true;
  thread_.join();
}

ClockFollower::ClockFollower(replay::FollowedClock& clock) {
  node_.setCallbackQueue(&queue_);
  subscriber_ = node_.subscribe<rosgraph_msgs::Clock>(
      kClockTopic, 1,
      [&clock](const rosgraph_msgs::ClockConstPtr& message) {
        clock.tick({static_cast<std::int64_t>(message->clock.toNSec())});
      },
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
  spinner_.start();
}

ClockFollower::~ClockFollower() { spinner_.stop(); }

}  // namespace afterglow::nodes
