#include "replay/store/message_lookup.hpp"

#include <algorithm>
#include <utility>

namespace afterglow::replay {

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
