/// \file
/// Files of recorded messages that are imported: bags of ROS 1, MCAP files, bags of ROS 2; others
/// are told by their first bytes. Internal to replay.
#pragma once

#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "replay/messages/message.hpp"

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

}  // namespace afterglow::replay
