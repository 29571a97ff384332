#include "nodes/console/foxglove_session.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <stdexcept>

namespace afterglow::nodes {

void FoxgloveSession::take(const SocketFrame& frame) {
  try {
    std::visit([this](const auto& request) { answer(request); }, readFoxglove(frame));
  } catch (const std::exception& error) {
    say(FoxgloveLevel::Error, error.what());
  }
}

void FoxgloveSession::greet(const FoxgloveServerInfo& info,
                            const std::vector<FoxgloveChannel>& channels) {
  frames_->push(serverInfoFrame(info));
  addChannels(channels);
}

void FoxgloveSession::addChannels(const std::vector<FoxgloveChannel>& channels) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const FoxgloveChannel& channel : channels) channels_[channel.id] = channel;
  frames_->push(advertiseFrame(channels));
}

void FoxgloveSession::removeChannels(const std::vector<std::uint32_t>& channels) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const std::uint32_t channel : channels) {
    channels_.erase(channel);
    for (auto at = subscriptions_.begin(); at != subscriptions_.end();) {
      if (at->second == channel) end(at->first);
      at = at->second == channel ? subscriptions_.erase(at) : std::next(at);
    }
  }
  frames_->push(unadvertiseFrame(channels));
}

void FoxgloveSession::add(const FoxgloveSubscription& subscription) {
  const auto channel = channels_.find(subscription.channel);
  if (channel == channels_.end()) {
    throw std::runtime_error("there is no channel " + std::to_string(subscription.channel));
  }
  const bool is_taken =
      std::any_of(subscriptions_.begin(), subscriptions_.end(), [&](const auto& known) {
        return known.first == subscription.id || known.second == subscription.channel;
      });
  if (is_taken) {
    throw std::runtime_error(channel->second.topic +
                             " is subscribed to already, or the "
                             "subscription's id is taken");
  }
  subscriptions_[subscription.id] = subscription.channel;
  begin(subscription, channel->second);
}

void FoxgloveSession::answer(const SubscribeRequest& request) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const FoxgloveSubscription& subscription : request.subscriptions) {
    try {
      add(subscription);
    } catch (const std::exception& refused) {
      say(FoxgloveLevel::Error, refused.what());
    }
  }
  begun();
}

void FoxgloveSession::answer(const UnsubscribeRequest& request) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const std::uint32_t id : request.ids) {
    if (subscriptions_.erase(id) > 0) end(id);
  }
}

void FoxgloveSession::answer(const ParametersRequest& request) {
  const std::set<std::string> names(request.names.begin(), request.names.end());
  FoxgloveParameters told, all = parameters();
  for (auto& [name, value] : all) {
    if (names.empty() || names.count(name) > 0) told[name] = std::move(value);
  }
  if (request.sets) say(FoxgloveLevel::Error, "parameters can only be read");
  frames_->push(parametersFrame(told, request.id));
}

void FoxgloveSession::answer(const RefusedRequest& request) {
  say(FoxgloveLevel::Error, request.why);
}

void FoxgloveSession::control(const PlaybackRequest&) {
  throw std::runtime_error("nothing is played here: the messages are live");
}

}  // namespace afterglow::nodes
