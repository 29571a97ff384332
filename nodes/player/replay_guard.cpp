#include "nodes/player/replay_guard.hpp"

#include <algorithm>
#include <iostream>
#include <thread>
#include <utility>

#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::uint32_t kStopQueue = 10;
constexpr std::int64_t kRosLook = 200'000'000;  // ns; whether ROS still runs
/// For subscribers that the master names: a dead one never connects.
constexpr double kConnectPatience = 2.0;

}  // namespace

void ReplayGuard::run() {
  while (!watch_.isOver() && ros::ok()) {
    while (const auto message = link_.receive()) hear(*message);
    if (link_.isClosed()) watch_.stop(replay::sinceBoot(), "the player is gone");
    if (isStopRequested()) {
      watch_.stop(replay::sinceBoot(), "the watchdog was ended by " + stopRequest());
    }
    brake();
    if (!watch_.isOver()) waitForNews();
  }
}

void ReplayGuard::waitForNews() {
  const replay::SteadyTime now = replay::sinceBoot();
  const std::int64_t wait_ns = std::min(watch_.deadline(), now.after(kRosLook)).ns - now.ns;
  if (link_.isClosed()) {
    clock_.sleepUntil(clock_.now().after(wait_ns));
  } else {
    // A request that has been seen is no news.
    link_.wait(static_cast<int>(std::max<std::int64_t>(0, (wait_ns + 999'999) / 1'000'000)),
               isStopRequested() ? -1 : stopRequestFd());
  }
}

void ReplayGuard::hear(const nlohmann::json& message) {
  const std::string kind = message.at("kind");
  if (kind == "output") {
    setOutput(message);
  } else if (kind == "ready?") {
    connect();
  } else if (kind == "beat") {
    watch_.setLongestSilence(message.at("patience_ns").get<std::int64_t>());
    watch_.beat(replay::sinceBoot(), message.at("moving").get<replay::Outputs>(),
                {message.at("sent_ns").get<std::int64_t>()});
    link_.send({{"kind", "beat"}});
  } else if (kind == "stop") {
    watch_.stop(replay::sinceBoot(), "the player asked for it");
  } else if (kind == "end") {
    watch_.end();
  }
}

void ReplayGuard::setOutput(const nlohmann::json& message) {
  const std::size_t index = message.at("index");
  outputs_.resize(std::max(outputs_.size(), index + 1));
  Output& output = outputs_[index];
  if (!output.publisher) {
    output.stop.morph(message.at("md5"), message.at("type"), message.at("definition"), "0");
    output.publisher = output.stop.advertise(node_, message.at("topic"), kStopQueue);
  }
  output.may_be_unheard = message.value("may_be_unheard", false);
  std::vector<std::uint8_t> bytes = message.at("stop").get_binary();
  ros::serialization::IStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  output.stop.read(stream);
}

/// A message on a connection that is not there yet would be lost.
void ReplayGuard::connect() {
  const Deadline deadline = deadlineIn(kConnectPatience);
  std::vector<std::string> unheard;
  do {
    unheard.clear();
    const RosGraph graph = askMaster(deadlineIn(kMasterPatience));
    for (const Output& output : outputs_) {
      const std::string topic = output.publisher.getTopic();
      if (output.publisher.getNumSubscribers() < graph.otherSubscribers(topic).size()) {
        unheard.push_back(topic);
      }
    }
    if (!unheard.empty()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  } while (!unheard.empty() && std::chrono::steady_clock::now() < deadline);
  link_.send({{"kind", "ready"}, {"unheard", unheard}});
}

void ReplayGuard::brake() {
  const replay::Outputs outputs = watch_.step(replay::sinceBoot());
  if (outputs.empty()) {
    return;
  }
  for (const std::uint32_t index : outputs) {
    if (index < outputs_.size()) outputs_[index].publisher.publish(outputs_[index].stop);
  }
  if (!std::exchange(has_told_, true)) {
    // The player may come to life again: it must not drive on.
    link_.send({{"kind", "braking"}, {"reason", watch_.reason()}});
    tell(outputs);
  }
}

/// Once the stop has been sent, and only of what somebody hears.
void ReplayGuard::tell(const replay::Outputs& stopped) const {
  std::string unheard;
  std::size_t heard = 0;
  for (const std::uint32_t index : stopped) {
    if (index < outputs_.size() && outputs_[index].publisher.getNumSubscribers() > 0) {
      ++heard;
    } else if (index < outputs_.size() && !outputs_[index].may_be_unheard) {
      unheard += " " + outputs_[index].publisher.getTopic();
    }
  }
  std::cerr << "afterglow_replay_guard: " << watch_.reason() << ": "
            << (heard > 0 ? "the robot is being stopped" : "the robot is NOT stopped")
            << (unheard.empty() ? "" : "; nobody hears the stop on" + unheard) << "\n";
}

}  // namespace afterglow::nodes
