/// \file
/// Reads the bytes of one stored message and checks them. Internal to replay/store.
#pragma once

#include <optional>
#include <string>

#include "replay/store/sqlite/sqlite.hpp"

namespace afterglow::replay {

/// Used under the lock of its connection, which it does not outlive.
class SqliteMessageReader {
 public:
  struct Contents {
    Bytes bytes;
    std::optional<Stamp> header_stamp;
    std::string problem;  ///< why the bytes are not those that were stored; empty: they are
  };

  explicit SqliteMessageReader(SqliteConnection& connection);
  Contents read(std::int64_t message);

 private:
  void readRow(std::int64_t message, Contents& contents);
  void readChunks(std::int64_t message, Contents& contents);

  SqliteStatement row_, chunks_;
  std::size_t size_ = 0;
  std::int64_t checksum_ = 0;
  bool is_chunked_ = false;
};

}  // namespace afterglow::replay
