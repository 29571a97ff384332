#include "nodes/player/rate_control.hpp"

#include <utility>

#include "replay/messages/field_edit.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::uint32_t kAnswerQueue = 10;

}  // namespace

RateControl::RateControl(const RateControlOptions& options, const replay::PlayPlan& plan,
                         bool has_recorded_time, replay::MessageSink& next, Replay replay)
    : topic_(options.topic),
      next_(next),
      replay_(std::move(replay)),
      lag_(options.longest_delay_s, plan.begin, has_recorded_time) {
  thread_.hear<Answer>(topic_, kAnswerQueue, [this](const Answer& answer) { onAnswer(answer); });
  thread_.begin();
}

bool RateControl::publish(const replay::Channel& channel, const replay::Bytes& bytes) {
  const replay::Stamp position = replay_.position();
  const bool is_heard = next_.publish(channel, bytes);
  follow([&] { lag_.onPublished(position, replay_.now()); });
  return is_heard;
}

void RateControl::onAnswer(const Answer& answer) {
  const ros::M_string& connection = answer.getConnectionHeader();
  const std::string& type = connection.at("type");
  try {
    if (!schema_ || schema_->root().name != type) {
      schema_ = replay::Schema::parse(type, connection.at("message_definition"));
    }
    const auto stamp = replay::headerStamp(*schema_, answer.getMessage()->bytes);
    if (stamp) return follow([&] { lag_.onAnswer(*stamp); });
  } catch (const replay::MessageError&) {  // likewise
  }
  replay_.stop(topic_ + " is to control the rate, but " + type + " does not begin with a header");
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
