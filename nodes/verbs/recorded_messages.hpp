/// \file
/// The messages of one type that were recorded with a behavior.
#pragma once

#include <functional>

#include "nodes/conversion/typed_message.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Calls `visit` for each of them in order, its context's, too; those that cannot be read are left
/// out. Throws replay::StoreError.
template <typename MessageType>
void eachRecorded(const replay::Store& store, const replay::Behavior& behavior,
                  const std::function<void(replay::Stamp, const MessageType&)>& visit) {
  namespace traits = ros::message_traits;
  replay::MessageRange range;
  for (const auto& known : {store.topics(behavior), store.contextTopics(behavior)}) {
    for (const replay::TopicSummary& topic : known) {
      if (topic.type == traits::DataType<MessageType>::value()) range.topics.push_back(topic.topic);
    }
  }
  if (range.topics.empty()) return;
  const auto cursor = store.messages(behavior, range);
  while (const auto message = cursor->next()) {
    const auto typed = toMessage<MessageType>(message->bytes);
    if (typed) visit(message->received, *typed);
  }
}

}  // namespace afterglow::nodes
