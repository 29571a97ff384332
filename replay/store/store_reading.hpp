/// \file
/// Channels of messages that are read one after the other, and single messages of a behavior, found
/// without reading all of it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

class Store;

/// Asks a store for each channel, and reads its definition, once. The store must outlive it. For
/// one thread.
class KnownChannels {
 public:
  explicit KnownChannels(const Store& store) : store_(store) {}

  /// Throws StoreError for an unknown id. The channel lives as long as this.
  const Channel& channel(std::int64_t id) { return of(id).channel; }
  /// Throws MessageError, each time, if the definition cannot be understood.
  const Schema& schema(std::int64_t id);

 private:
  struct Known {
    Channel channel;
    std::optional<Schema> schema;
    std::string why_none;
  };
  Known& of(std::int64_t id);

  const Store& store_;
  std::map<std::int64_t, Known> known_;
};

/// Returns the newest message on the topic, a behavior's own or one of its context, at or before
/// the moment; found by looking back twice as far each time. Throws StoreError.
std::optional<Message> newestMessage(const Store& store, const Behavior& behavior,
                                     const std::string& topic, Stamp moment);

}  // namespace afterglow::replay
