/// \file
/// Damaged or lost messages in words, a line for each topic. Internal to replay/store.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "replay/store/sqlite/sqlite.hpp"

namespace afterglow::replay {

class DamageRanges {
 public:
  void add(std::int64_t channel, std::int64_t received_ns, const std::string& problem);
  bool empty() const { return ranges_.empty(); }
  /// `damaged` is what has become of them: "damaged", "lost". Names come from `connection`'s store.
  std::vector<std::string> lines(SqliteConnection& connection, const std::string& damaged) const;

 private:
  struct Range {
    std::uint64_t count = 0;
    std::int64_t first_ns = 0, last_ns = 0;
    std::string problem;  ///< of the first
  };
  std::map<std::int64_t, Range> ranges_;  ///< by channel
};

}  // namespace afterglow::replay
