/// \file
/// The SQLite files of ROS 2's bags. Internal to replay. Source of their tables: rosbag2,
/// rosbag2_storage_sqlite3 (schema versions 1 to 4).
#pragma once

#include <map>

#include "replay/bags/recorded_file.hpp"
#include "replay/bags/topic_intake.hpp"
#include "replay/store/sqlite/sqlite.hpp"

namespace afterglow::replay {

/// Releases before Iron wrote no definitions: then those of common types are known
/// (ros2/ros2_definition.hpp), and other topics are left out.
class Ros2Database : public RecordedFile {
 public:
  Ros2Database(const std::string& path, FindDefinition find);

  const std::string& path() const override { return path_; }
  std::uint64_t total() const override { return total_; }
  Stamp begin() const override { return begin_; }
  std::optional<Item> next() override;
  const Channel& channel(std::uint32_t id) const override { return intake_.channel(id); }
  std::vector<std::string> remarks() const override { return intake_.remarks(); }

 private:
  struct Definition {
    std::string kind, text;
  };

  [[noreturn]] void fail(const std::string& text) const;
  /// Runs what asks the database.
  template <typename Work>
  auto ask(const Work& work) const;
  void requireTable(const std::string& name);
  bool hasColumn(const std::string& table, const std::string& column);
  std::map<std::string, Definition> readDefinitions();
  void readTopics();

  const std::string path_;
  std::unique_ptr<SqliteConnection> connection_;
  std::unique_ptr<SqliteStatement> messages_;
  std::uint64_t total_ = 0;
  Stamp begin_;
  std::map<std::int64_t, std::uint32_t> ids_;  ///< ids of topics, by their rows
  TopicIntake intake_;
};

}  // namespace afterglow::replay
