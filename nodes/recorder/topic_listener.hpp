/// \file
/// Type-erased subscriptions that feed a recorder: any topic, of any type, whether it is announced
/// yet or not.
#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <topic_tools/shape_shifter.h>

#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "replay/record/recorder.hpp"

namespace afterglow::nodes {

/// Subscriptions are shared: several behaviors may record one topic. Messages are taken by one
/// thread of the listener's own, in the order of arrival, stamped when they arrived (not when they
/// were taken). The recorder must outlive the listener. Any thread.
class TopicListener {
 public:
  explicit TopicListener(replay::Recorder& recorder);
  ~TopicListener();
  TopicListener(const TopicListener&) = delete;
  TopicListener& operator=(const TopicListener&) = delete;

  /// Each acquire wants one release.
  void acquire(const std::vector<std::string>& topics);
  void release(const std::vector<std::string>& topics);
  /// Returns when every message that had arrived at the call has been given to the recorder.
  void drain();

 private:
  using Event = ros::MessageEvent<const topic_tools::ShapeShifter>;
  struct Subscription {
    ros::Subscriber subscriber;
    int users = 0;
  };

  ros::Subscriber subscribe(const std::string& topic);
  void onMessage(const std::string& topic, const Event& event);
  std::size_t channelOf(const std::string& topic, const Event& event);

  replay::Recorder& recorder_;
  ros::NodeHandle node_;
  ros::CallbackQueue queue_;
  std::mutex mutex_;
  std::map<std::string, Subscription> subscriptions_;
  /// The listener thread's: connection headers seen (one object per connection) and their channels.
  std::map<boost::shared_ptr<ros::M_string>, std::size_t> channels_;
  ros::AsyncSpinner spinner_;
};

}  // namespace afterglow::nodes
