#include "nodes/console/recorded_message.hpp"

#include <algorithm>

namespace afterglow::nodes {

std::optional<replay::Message> newestMessage(const replay::Store& store,
                                             const replay::Behavior& behavior,
                                             const std::string& topic, replay::Stamp moment) {
  replay::MessageRange range;
  range.topics = {topic};
  std::int64_t end_ns = moment.ns + 1, step_ns = 50'000'000;
  while (end_ns > behavior.begin.ns) {
    const std::int64_t begin_ns = std::max(behavior.begin.ns, end_ns - step_ns);
    range.begin = replay::Stamp{begin_ns};
    range.end = replay::Stamp{end_ns};
    const auto cursor = store.messages(behavior, range);
    std::optional<replay::Message> newest;
    while (auto message = cursor->next()) newest = std::move(message);
    if (newest) return newest;
    end_ns = begin_ns;
    step_ns *= 2;
  }
  return std::nullopt;
}

}  // namespace afterglow::nodes
