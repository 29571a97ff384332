#include "replay/store/sqlite/salvage.hpp"

#include <algorithm>
#include <limits>

namespace afterglow::replay {

SalvagedTable::SalvagedTable(SqliteConnection& connection, const std::string& columns,
                             const std::string& table)
    : rows_(connection,
            "SELECT " + columns + " FROM " + table + " WHERE rowid >= ?1 ORDER BY rowid"),
      next_(std::numeric_limits<std::int64_t>::min()) {}

bool SalvagedTable::read(const std::function<void(const SqliteStatement& row)>& take) {
  bool is_whole = true;
  while (!readOn(take)) {
    is_whole = false;
    const auto next = behindGap();
    if (!next) break;
    next_ = *next;
  }
  return is_whole;
}

/// False: damage stopped it.
bool SalvagedTable::readOn(const std::function<void(const SqliteStatement& row)>& take) {
  const StatementScope scope(rows_);
  rows_.bind(1, next_);
  for (;;) {
    try {
      if (!rows_.step()) return true;
      next_ = rows_.integer(0) + 1;
    } catch (const SqliteDamage&) {
      return false;
    }
    take(rows_);
  }
}

bool SalvagedTable::canReadFrom(std::int64_t row) {
  const StatementScope scope(rows_);
  try {
    rows_.bind(1, row).step();
    return true;
  } catch (const SqliteDamage&) {
    return false;
  }
}

/// The smallest row number from which on reading is possible again.
std::optional<std::int64_t> SalvagedTable::behindGap() {
  constexpr std::int64_t kFarthest = std::int64_t{1} << 62;
  std::int64_t bad = std::max<std::int64_t>(next_, 0);
  std::int64_t step = 1;
  while (step < kFarthest - bad && !canReadFrom(bad + step)) {
    bad += step;
    step *= 2;
  }
  if (step >= kFarthest - bad) return std::nullopt;
  std::int64_t good = bad + step;
  while (good - bad > 1) {
    const std::int64_t middle = bad + (good - bad) / 2;
    (canReadFrom(middle) ? good : bad) = middle;
  }
  return good;
}

}  // namespace afterglow::replay
