/// \file
/// Files that recordings are exported to. Internal to replay.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "replay/bags/packing.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// A file under a temporary name until it is complete; removed if it is never published. Methods
/// throw BagError.
class ExportFile {
 public:
  explicit ExportFile(const std::string& path);
  ExportFile(const ExportFile&) = delete;
  ExportFile& operator=(const ExportFile&) = delete;
  virtual ~ExportFile();

  /// `channel` is the message's.
  virtual void write(const Message& message, const Channel& channel) = 0;
  virtual std::uint64_t size() const = 0;  ///< approximately
  /// Returns the number of messages that had the stamp 0 and have another here.
  virtual std::uint64_t unstamped() const { return 0; }
  /// Ends writing, and has the disk keep it.
  virtual void close() = 0;

  const std::string& path() const { return path_; }
  /// Moves a closed file to path(), and has the disk keep that, too.
  void publish();

 protected:
  const std::string& partial() const { return partial_; }
  void sync() const;

 private:
  const std::string path_, partial_;
  bool is_published_ = false;
};

/// A bag of ROS 1, of None, Bz2 or Lz4.
std::unique_ptr<ExportFile> writeRosbag(const std::string& path, Packing packing);

/// An MCAP file of None, Lz4 or Zstd, of ROS 1 messages or of ROS 2's, with a record about each
/// behavior.
std::unique_ptr<ExportFile> writeMcap(const std::string& path, Packing packing, bool is_ros2,
                                      const std::vector<Behavior>& behaviors);

}  // namespace afterglow::replay
