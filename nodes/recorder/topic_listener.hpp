/// \file
/// Type-erased subscriptions that feed a recorder: any topic, of any type, whether it is announced
/// yet or not.
#pragma once

#include <ros/ros.h>

#include <map>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "nodes/conversion/typed_message.hpp"
#include "nodes/tools/immediate_callbacks.hpp"
#include "replay/record/recorder.hpp"

namespace afterglow::nodes {

/// Subscriptions are shared: several behaviors may record one topic. Messages go to the recorder
/// from roscpp's network thread itself, as they are read from their sockets: nothing waits between
/// the network and the recorder's bounded queue. Stamped with ROS time then. A publisher that goes
/// and comes again is heard again. The recorder must outlive the listener. Any thread.
class TopicListener {
 public:
  explicit TopicListener(replay::Recorder& recorder) : recorder_(recorder) {}
  ~TopicListener();
  TopicListener(const TopicListener&) = delete;
  TopicListener& operator=(const TopicListener&) = delete;

  /// Listens to topics; each acquire wants one release.
  void acquire(const std::vector<std::string>& topics);
  void release(const std::vector<std::string>& topics);
  /// roscpp settles a subscription on the first type it meets. Begins those anew that have lost
  /// their last publisher, or whose latest one has another type (`types`: by topic, as the master
  /// says; once for each type). To be called often.
  void renew(const std::map<std::string, std::string>& types);
  /// The topics that are listened to now.
  std::vector<std::string> topics() const;
  /// The nodes whose messages came on a topic that is listened to, by their connections' headers.
  std::set<std::string> senders(const std::string& topic) const;

 private:
  using Event = ros::MessageEvent<RawMessage>;
  struct Subscription {
    ros::Subscriber subscriber;
    int users = 0;
    bool has_publishers = false;
    std::string renewed_for;  ///< the type that made it begin anew
  };

  ros::Subscriber subscribe(const std::string& topic);
  std::string typeHeard(const std::string& topic);
  void onMessage(const std::string& topic, const Event& event);
  std::size_t channelOf(const std::string& topic, const Event& event);

  replay::Recorder& recorder_;
  ros::NodeHandle node_;
  ImmediateCallbacks immediately_;
  mutable std::mutex mutex_;  ///< subscriptions_; callbacks do not take it
  std::map<std::string, Subscription> subscriptions_;
  mutable std::mutex channels_mutex_;  ///< the rest
  /// Connection headers seen (one object per connection) and their channels.
  std::map<boost::shared_ptr<ros::M_string>, std::size_t> channels_;
  std::map<std::string, std::string> types_;  ///< heard since the subscription began, by topic
  std::map<std::string, std::set<std::string>> senders_;  ///< senders by topic
};

/// True if a socket of this process holds bytes that were not read yet. roscpp does not say.
bool hasUnreadInput();

}  // namespace afterglow::nodes
