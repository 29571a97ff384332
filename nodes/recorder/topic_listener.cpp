#include "nodes/recorder/topic_listener.hpp"

#include <future>

namespace afterglow::nodes {
namespace {

/// Tells when the queue has come as far as this.
class Marker : public ros::CallbackInterface {
 public:
  CallResult call() override {
    reached_.set_value();
    return Success;
  }
  std::future<void> reached() { return reached_.get_future(); }

 private:
  std::promise<void> reached_;
};

std::string valueOf(const ros::M_string& header, const std::string& key) {
  const auto found = header.find(key);
  return found == header.end() ? std::string() : found->second;
}

}  // namespace

TopicListener::TopicListener(replay::Recorder& recorder)
    : recorder_(recorder), spinner_(1, &queue_) {
  spinner_.start();
}

TopicListener::~TopicListener() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    subscriptions_.clear();
  }
  spinner_.stop();
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
  std::vector<std::string> unused;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const std::string& topic : topics) {
      const auto found = subscriptions_.find(topic);
      if (found != subscriptions_.end() && --found->second.users == 0) {
        subscriptions_.erase(found);
        unused.push_back(topic);
      }
    }
  }
  drain();  // a message on its way would be remembered after it was forgotten
  for (const std::string& topic : unused) {
    recorder_.forgetLatched(topic);
  }
}

void TopicListener::drain() {
  const auto marker = boost::make_shared<Marker>();
  std::future<void> reached = marker->reached();
  queue_.addCallback(marker);
  // A queue that is shut down calls nobody any more.
  while (ros::ok() &&
         reached.wait_for(std::chrono::milliseconds(100)) == std::future_status::timeout) {
  }
}

ros::Subscriber TopicListener::subscribe(const std::string& topic) {
  ros::SubscribeOptions options;
  // No bound here: what waits for this thread is copied into the recorder's bounded queue, where
  // drops are counted; roscpp would drop without a word.
  options.initByFullCallbackType<const Event&>(
      topic, 0, [this, topic](const Event& event) { onMessage(topic, event); });
  options.callback_queue = &queue_;
  options.transport_hints = ros::TransportHints().tcpNoDelay();
  return node_.subscribe(options);
}

void TopicListener::onMessage(const std::string& topic, const Event& event) {
  const topic_tools::ShapeShifter& message = *event.getConstMessage();
  replay::Bytes bytes(message.size());
  ros::serialization::OStream stream(bytes.data(), message.size());
  message.write(stream);
  const std::uint64_t received = event.getReceiptTime().toNSec();
  recorder_.offer(channelOf(topic, event), {static_cast<std::int64_t>(received)}, std::move(bytes));
}

std::size_t TopicListener::channelOf(const std::string& topic, const Event& event) {
  const boost::shared_ptr<ros::M_string> header = event.getConnectionHeaderPtr();
  const auto known = channels_.find(header);
  if (known != channels_.end()) {
    return known->second;
  }
  const topic_tools::ShapeShifter& message = *event.getConstMessage();
  const replay::Channel channel{topic,
                                message.getDataType(),
                                message.getMD5Sum(),
                                message.getMessageDefinition(),
                                valueOf(*header, "latching") == "1",
                                valueOf(*header, "callerid")};
  return channels_[header] = recorder_.channelIndex(channel);
}

}  // namespace afterglow::nodes
