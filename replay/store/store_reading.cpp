#include "replay/store/store_reading.hpp"

#include <algorithm>
#include <utility>

#include "replay/store/store.hpp"

namespace afterglow::replay {

KnownChannels::Known& KnownChannels::of(std::int64_t id) {
  const auto found = known_.find(id);
  if (found != known_.end()) return found->second;
  return known_.emplace(id, Known{store_.channel(id), std::nullopt, ""}).first->second;
}

const Schema& KnownChannels::schema(std::int64_t id) {
  Known& known = of(id);
  if (!known.why_none.empty()) throw MessageError(known.why_none);
  try {
    if (!known.schema) known.schema = Schema::of(known.channel);
  } catch (const MessageError& error) {
    known.why_none = error.what();
    throw;
  }
  return *known.schema;
}

std::optional<Message> newestMessage(const Store& store, const Behavior& behavior,
                                     const std::string& topic, Stamp moment) {
  MessageRange range;
  range.topics = {topic};
  std::int64_t end_ns = moment.ns + 1, step_ns = 50'000'000;
  while (end_ns > behavior.begin.ns) {
    const std::int64_t begin_ns = std::max(behavior.begin.ns, end_ns - step_ns);
    range.begin = Stamp{begin_ns};
    range.end = Stamp{end_ns};
    const auto cursor = store.messages(behavior, range);
    std::optional<Message> newest;
    while (auto message = cursor->next()) newest = std::move(message);
    if (newest) return newest;
    end_ns = begin_ns;
    step_ns *= 2;
  }
  return std::nullopt;
}

}  // namespace afterglow::replay
