#include "nodes/player/rate_control.hpp"

#include <cstring>
#include <utility>

#include "replay/messages/schema.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::uint32_t kAnswerQueue = 10;

bool beginsWithHeader(const std::string& type, const std::string& definition) {
  try {
    const replay::Schema schema = replay::Schema::parse(type, definition);
    const auto& fields = schema.root().fields;
    return !fields.empty() && fields.front().type == replay::FieldType::Message &&
           fields.front().arity == replay::Field::Arity::Single &&
           schema.types()[fields.front().message].name == "std_msgs/Header";
  } catch (const replay::MessageError&) {
    return false;
  }
}

/// Of a header that the message begins with: sequence number, seconds, nanoseconds.
replay::Stamp headerStamp(const replay::Bytes& bytes) {
  std::uint32_t words[3] = {};
  if (bytes.size() >= sizeof(words)) std::memcpy(words, bytes.data(), sizeof(words));
  return {static_cast<std::int64_t>(words[1]) * 1'000'000'000 + words[2]};
}

}  // namespace

RateControl::RateControl(const RateControlOptions& options, const replay::PlayPlan& plan,
                         bool has_recorded_time, replay::MessageSink& next, Replay replay)
    : topic_(options.topic),
      next_(next),
      replay_(std::move(replay)),
      lag_(options.longest_delay_s, plan.begin, has_recorded_time) {
  ros::SubscribeOptions subscription;
  subscription.initByFullCallbackType<const Answer&>(
      topic_, kAnswerQueue, [this](const Answer& answer) { onAnswer(answer); });
  subscription.callback_queue = &queue_;
  subscriber_ = node_.subscribe(subscription);
  spinner_.start();
}

RateControl::~RateControl() {
  subscriber_.shutdown();
  spinner_.stop();
}

bool RateControl::publish(const replay::Channel& channel, const replay::Bytes& bytes) {
  const replay::Stamp position = replay_.position();
  const bool is_heard = next_.publish(channel, bytes);
  follow([&] { lag_.onPublished(position, replay_.now()); });
  return is_heard;
}

void RateControl::onAnswer(const Answer& answer) {
  const ros::M_string& connection = answer.getConnectionHeader();
  const std::string type = connection.at("type");
  if (type != type_) {
    type_ = type;
    if (!beginsWithHeader(type, connection.at("message_definition"))) {
      replay_.stop(topic_ + " is to control the rate, but " + type +
                   " does not begin with a header");
    }
  }
  follow([&] { lag_.onAnswer(headerStamp(answer.getMessage()->bytes)); });
}

/// The replay is told by one thread at a time, in the order in which things changed.
void RateControl::follow(const std::function<void()>& change) {
  const std::lock_guard<std::mutex> lock(mutex_);
  change();
  if (lag_.isBehind() != is_held_) {
    is_held_ = !is_held_;
    replay_.hold(is_held_);
  }
}

}  // namespace afterglow::nodes
