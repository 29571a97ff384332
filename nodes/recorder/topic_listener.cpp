#include "nodes/recorder/topic_listener.hpp"

#include <sys/ioctl.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <utility>

namespace afterglow::nodes {
namespace {

std::string valueOf(const ros::M_string& header, const std::string& key) {
  const auto found = header.find(key);
  return found == header.end() ? std::string() : found->second;
}

}  // namespace

TopicListener::~TopicListener() {
  const std::lock_guard<std::mutex> lock(mutex_);
  subscriptions_.clear();
}

void TopicListener::acquire(const std::vector<std::string>& topics) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const std::string& topic : topics) {
    Subscription& subscription = subscriptions_[topic];
    if (subscription.users++ == 0) {
      subscription.subscriber = subscribe(topic);
    }
  }
}

void TopicListener::release(const std::vector<std::string>& topics) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const std::string& topic : topics) {
    const auto found = subscriptions_.find(topic);
    if (found != subscriptions_.end() && --found->second.users == 0) {
      subscriptions_.erase(found);
      recorder_.forgetLatched(topic);
      const std::lock_guard<std::mutex> channels_lock(channels_mutex_);
      senders_.erase(topic);
      types_.erase(topic);
    }
  }
}

void TopicListener::renew(const std::map<std::string, std::string>& types) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (auto& [topic, subscription] : subscriptions_) {
    const bool has_publishers = subscription.subscriber.getNumPublishers() > 0;
    const bool is_left =
        std::exchange(subscription.has_publishers, has_publishers) && !has_publishers;
    const std::string heard = typeHeard(topic);
    const auto announced = types.find(topic);
    const bool is_changed = !heard.empty() && announced != types.end() &&
                            announced->second != "*" && announced->second != heard &&
                            announced->second != subscription.renewed_for;
    const bool is_missing = !subscription.subscriber;  // no master answered
    if (!is_missing && !is_left && !is_changed) {
      continue;
    }
    subscription.renewed_for = is_changed ? announced->second : "";
    subscription.subscriber.shutdown();  // first: roscpp shares what two subscribers want
    {
      const std::lock_guard<std::mutex> channels_lock(channels_mutex_);
      types_.erase(topic);
    }
    subscription.subscriber = subscribe(topic);
  }
}

std::string TopicListener::typeHeard(const std::string& topic) {
  const std::lock_guard<std::mutex> lock(channels_mutex_);
  const auto found = types_.find(topic);
  return found == types_.end() ? std::string() : found->second;
}

std::vector<std::string> TopicListener::topics() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::string> names;
  for (const auto& [topic, subscription] : subscriptions_) {
    names.push_back(topic);
  }
  return names;
}

std::set<std::string> TopicListener::senders(const std::string& topic) const {
  const std::lock_guard<std::mutex> lock(channels_mutex_);
  const auto found = senders_.find(topic);
  return found == senders_.end() ? std::set<std::string>() : found->second;
}

ros::Subscriber TopicListener::subscribe(const std::string& topic) {
  ros::SubscribeOptions options;
  options.initByFullCallbackType<const Event&>(
      topic, 0, [this, topic](const Event& event) { onMessage(topic, event); });
  immediately_.take(options);
  options.transport_hints = ros::TransportHints().tcpNoDelay();
  return node_.subscribe(options);
}

void TopicListener::onMessage(const std::string& topic, const Event& event) {
  // Not the event's receipt time: a latched message that roscpp had already comes with that of old.
  const std::uint64_t received = ros::Time::now().toNSec();
  const auto steady_ns = static_cast<std::int64_t>(ros::SteadyTime::now().toNSec());
  recorder_.offer(channelOf(topic, event), {static_cast<std::int64_t>(received)},
                  std::move(event.getMessage()->bytes),
                  ros::Time::isSimTime() ? std::nullopt : std::optional(steady_ns));
}

std::size_t TopicListener::channelOf(const std::string& topic, const Event& event) {
  const boost::shared_ptr<ros::M_string>& header = event.getConnectionHeaderPtr();
  const std::lock_guard<std::mutex> lock(channels_mutex_);
  const auto known = channels_.find(header);
  if (known != channels_.end()) {
    return known->second;
  }
  const replay::Channel channel{topic,
                                valueOf(*header, "type"),
                                valueOf(*header, "md5sum"),
                                valueOf(*header, "message_definition"),
                                valueOf(*header, "latching") == "1",
                                valueOf(*header, "callerid")};
  // Publishers come and go for as long as a robot runs: what only this map still holds is forgotten.
  for (auto held = channels_.begin(); held != channels_.end();) {
    held = held->first.use_count() == 1 ? channels_.erase(held) : std::next(held);
  }
  types_[topic] = channel.type;
  if (!channel.caller_id.empty()) senders_[topic].insert(channel.caller_id);
  return channels_[header] = recorder_.channelIndex(channel);
}

bool hasUnreadInput() {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", error)) {
    const int fd = std::atoi(entry.path().filename().c_str());
    struct stat kind {};
    int unread = 0;
    if (fstat(fd, &kind) == 0 && S_ISSOCK(kind.st_mode) && ioctl(fd, FIONREAD, &unread) == 0 &&
        unread > 0) {
      return true;
    }
  }
  return false;
}

}  // namespace afterglow::nodes
