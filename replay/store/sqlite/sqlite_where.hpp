/// \file
/// Which behaviors of a SQLite store match a filter, with the help of its field index. Internal to
/// replay/store.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "replay/store/sqlite/channel_answers.hpp"
#include "replay/store/sqlite/sqlite_message_reader.hpp"

namespace afterglow::replay {

/// Used under the lock of the connection.
class SqliteWhere {
 public:
  /// For behaviors in [begin, end). All must outlive it.
  SqliteWhere(SqliteConnection& connection, SqliteFieldIndex& index, const Filter& filter,
              std::int64_t begin_ns, std::int64_t end_ns);

  bool matches(const Behavior& behavior);
  /// A line for each topic that was asked for: how many blocks the index ruled out, was sure of,
  /// and left to be read.
  std::vector<std::string> explain() const;

 private:
  struct Count {
    std::uint64_t blocks = 0, ruled_out = 0, sure = 0, read = 0, messages = 0;
  };
  struct Part {
    std::int64_t channel, first_ns, last_ns;
  };
  bool anyMessage(const Behavior& behavior, const std::string& topic, const Condition& condition);
  std::vector<Part> partsOf(const Behavior& behavior, const std::string& topic);
  const ChannelAnswers& answersOf(std::int64_t channel, const Condition& condition);
  /// Which stretches of the part must be read; empty: a message matches surely.
  std::optional<std::vector<Part>> openStretches(const ChannelAnswers& answers, const Part& part,
                                                 Count& count) const;
  bool anyOf(std::int64_t recording, const Part& stretch, const ChannelAnswers& answers,
             Count& count);

  SqliteConnection& connection_;
  SqliteFieldIndex& index_;
  const Filter& filter_;
  std::int64_t begin_ns_, end_ns_;
  SqliteMessageReader reader_;
  SqliteStatement scan_;
  std::map<std::pair<std::int64_t, const Condition*>, ChannelAnswers> answers_;
  std::map<std::string, Count> counts_;  ///< by topic
};

}  // namespace afterglow::replay
