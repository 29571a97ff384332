/// \file
/// Reads a table of a damaged database around what is damaged. Internal to replay/store.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "replay/store/sqlite/sqlite.hpp"

namespace afterglow::replay {

/// Rows by row number. Where a page cannot be read, reading goes on with the first row behind it,
/// which is found by doubling steps and then halving them.
class SalvagedTable {
 public:
  /// `columns` of `table`; the row number, "rowid", must be the first. The connection must outlive
  /// it.
  SalvagedTable(SqliteConnection& connection, const std::string& columns, const std::string& table);

  /// Calls `take` with each row that can be read. False: there were gaps.
  bool read(const std::function<void(const SqliteStatement& row)>& take);

 private:
  bool readOn(const std::function<void(const SqliteStatement& row)>& take);
  bool canReadFrom(std::int64_t row);
  std::optional<std::int64_t> behindGap();

  SqliteStatement rows_;
  std::int64_t next_;  ///< row to be read next
};

}  // namespace afterglow::replay
