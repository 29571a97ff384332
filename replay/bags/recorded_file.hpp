/// \file
/// Files of recorded messages that are imported: bags of ROS 1, MCAP files, bags of ROS 2; others
/// are told by their first bytes. Internal to replay.
///
/// The SQLite files of ROS 2's bags. Internal to replay. Source of their tables: rosbag2,
/// rosbag2_storage_sqlite3 (schema versions 1 to 4).
#pragma once

#include <cstdint>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "replay/bags/topic_intake.hpp"
#include "replay/messages/message.hpp"
#include "replay/store/sqlite/sqlite.hpp"

namespace afterglow::replay {

/// The bytes of a file that may come from anybody. Throws BagError naming the file and the place in
/// it.
class FileBytes {
 public:
  explicit FileBytes(const std::string& path);

  const std::string& path() const { return path_; }
  std::uint64_t fileSize() const { return size_; }
  /// `what`: a noun for what lies there.
  Bytes read(std::uint64_t at, std::uint64_t size, const char* what = "a record");
  [[noreturn]] void fail(const std::string& text) const;

 private:
  const std::string path_;
  std::ifstream file_;
  std::uint64_t size_ = 0;
};

/// Read once, from its beginning to its end, with memory for a part of it. Methods throw BagError
/// naming the file and the place in it.
class RecordedFile {
 public:
  struct Item {
    std::uint32_t channel = 0;
    Stamp received;
    Bytes bytes;  ///< bytes as ROS 1 serializes
  };

  virtual ~RecordedFile() = default;

  virtual const std::string& path() const = 0;
  /// Returns the file's own count of its messages; 0: it does not say.
  virtual std::uint64_t total() const = 0;
  /// Returns the stamp of its first message, as the file says.
  virtual Stamp begin() const = 0;
  /// Messages of equal stamps in the order they were recorded; empty at the end.
  virtual std::optional<Item> next() = 0;
  /// Returns the channel of an item.
  virtual const Channel& channel(std::uint32_t id) const = 0;
  /// Returns remarks on what was left out so far and what a user should know, one line each.
  virtual std::vector<std::string> remarks() const { return {}; }
  /// Returns why it ends before its recording did; empty: it is whole. Complete once all is read.
  virtual std::string whyIncomplete() const { return ""; }
};

/// The file, or those of a ROS 2 bag's folder. Throws BagError for what is no recording.
std::vector<std::unique_ptr<RecordedFile>> openRecording(const std::string& path);

/// Says what the file is instead of a recording, and the way out; empty: it may be one. `beginning`
/// holds its first 512 bytes, or all of them.
std::string otherThanRecording(std::string_view beginning);

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
