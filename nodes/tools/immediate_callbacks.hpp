/// \file
/// Callbacks in roscpp's network thread, as messages are read from their sockets.
#pragma once

#include <ros/callback_queue_interface.h>
#include <ros/subscribe_options.h>

#include <cstdint>

namespace afterglow::nodes {

/// Calls at once. roscpp adds callbacks under the subscription's lock, so they come one by one, and
/// none comes after the subscription's end. Nothing waits, nor is dropped, between the network and
/// the callback; a callback that takes long makes publishers wait. Outlives its subscriptions.
class ImmediateCallbacks : public ros::CallbackQueueInterface {
 public:
  /// Makes a subscription's callback one of these.
  void take(ros::SubscribeOptions& options) {
    options.callback_queue = this;
    options.queue_size = 0;                     // never more than one message waits there
    options.allow_concurrent_callbacks = true;  // else roscpp puts off what it cannot call at once
  }
  void addCallback(const ros::CallbackInterfacePtr& callback, std::uint64_t) override {
    callback->call();
  }
  void removeByID(std::uint64_t) override {}
};

}  // namespace afterglow::nodes
