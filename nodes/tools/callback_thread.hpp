/// \file
/// A thread of its own for the messages that a class hears, of a known type or of any.
#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <topic_tools/shape_shifter.h>

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "replay/messages/message.hpp"

namespace afterglow::nodes {

/// A message with its sender.
using AnyMessage = ros::MessageEvent<const topic_tools::ShapeShifter>;

inline replay::Bytes bytesOf(const topic_tools::ShapeShifter& message) {
  replay::Bytes bytes(message.size());
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  message.write(stream);
  return bytes;
}

/// Calls the callbacks of subscriptions and timers, none before begin() and none after end(). As
/// the last member of a class its destructor ends it before what the callbacks use is gone.
class CallbackThread {
 public:
  explicit CallbackThread(std::uint32_t threads = 1) : spinner_(threads, &queue_) {
    node_.setCallbackQueue(&queue_);
  }
  ~CallbackThread() { end(); }
  CallbackThread(const CallbackThread&) = delete;
  CallbackThread& operator=(const CallbackThread&) = delete;

  /// `Heard`: a message, or a ros::MessageEvent, which tells who sent it.
  template <typename Heard>
  ros::Subscriber hear(const std::string& topic, std::uint32_t queue,
                       std::function<void(const Heard&)> take,
                       const ros::TransportHints& hints = {}) {
    ros::SubscribeOptions options;
    options.initByFullCallbackType<const Heard&>(topic, queue, std::move(take));
    options.transport_hints = hints;
    subscribers_.push_back(node_.subscribe(options));
    return subscribers_.back();
  }
  /// Calls `act` in steady time.
  ros::SteadyTimer every(double seconds, std::function<void()> act) {
    const auto call = [act = std::move(act)](const ros::SteadyTimerEvent&) { act(); };
    timers_.push_back(node_.createSteadyTimer(ros::WallDuration(seconds), call));
    return timers_.back();
  }
  void hearNoMore() {
    for (ros::Subscriber& subscriber : subscribers_) subscriber.shutdown();
  }

  void begin() { spinner_.start(); }
  /// Stops calling from now on, but by callRest(), in the caller's thread: what is heard by then.
  void stop() {
    for (ros::SteadyTimer& timer : timers_) timer.stop();
    spinner_.stop();
  }
  void callRest() { queue_.callAvailable(); }
  void end() {
    stop();
    hearNoMore();
  }

 private:
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::SteadyTimer> timers_;
  ros::AsyncSpinner spinner_;
};

}  // namespace afterglow::nodes
