#include "replay/store/sqlite/damage_ranges.hpp"

#include <algorithm>

#include "replay/query/time_text.hpp"

namespace afterglow::replay {
namespace {

std::string channelName(SqliteConnection& connection, std::int64_t channel) {
  try {
    SqliteStatement query(connection, "SELECT recording, topic FROM channels WHERE id = ?1");
    if (query.bind(1, channel).step()) {
      return "recording " + std::to_string(query.integer(0)) + ", " + query.text(1);
    }
  } catch (const SqliteDamage&) {
    // Its row is among what is damaged.
  }
  return "channel " + std::to_string(channel);
}

}  // namespace

void DamageRanges::add(std::int64_t channel, std::int64_t received_ns, const std::string& problem) {
  Range& range = ranges_[channel];
  if (range.count++ == 0) range = {1, received_ns, received_ns, problem};
  range.first_ns = std::min(range.first_ns, received_ns);
  range.last_ns = std::max(range.last_ns, received_ns);
}

std::vector<std::string> DamageRanges::lines(SqliteConnection& connection,
                                             const std::string& damaged) const {
  std::vector<std::string> lines;
  for (const auto& [channel, range] : ranges_) {
    std::string line = channelName(connection, channel) + ": ";
    if (range.count == 1) {
      line += "a message is " + damaged + ", of " + timeText(Stamp{range.first_ns});
    } else {
      line += std::to_string(range.count) + " messages are " + damaged + ", from " +
              timeText(Stamp{range.first_ns}) + " to " + timeText(Stamp{range.last_ns});
    }
    lines.push_back(line + ": " + range.problem);
  }
  return lines;
}

}  // namespace afterglow::replay
