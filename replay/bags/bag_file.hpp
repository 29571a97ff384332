/// \file
/// Rosbags (format 2.0, plain, bz2 or lz4) and MCAP files into a store and out of one; bags of ROS
/// 2 (sqlite3 or MCAP) into a store. Files packed with zstd need libzstd; built without it, they
/// throw BagError saying so.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// A bag cannot be read or written; the text names the file, where in it, and why.
class BagError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Called now and then with how many messages of how many are through.
using BagProgress = std::function<void(std::uint64_t done, std::uint64_t total)>;

struct BagImport {
  std::string name;  ///< name of the behavior; empty: the file's name without ".bag", the folder's
  std::vector<std::string> tags;
  BagProgress progress;
};

struct BagImportResult {
  Behavior behavior;
  std::uint64_t messages = 0;
  /// Remarks on what was left out, what keeps the fields of ROS 2, what was not closed; one line
  /// each, with the file. They are the behavior's remarks, too.
  std::vector<std::string> remarks;
};

/// Bags, MCAP files or folders of ROS 2's bags as one recording and, over it, one behavior with
/// outcome "imported" ("incomplete" if one of them was not closed) on all their topics. Order: the
/// bags' stamps, then the bags by their first stamps, then position in the file, which is the order
/// they were recorded in. Messages of ROS 2 become those of ROS 1 (ros2/ros2_topic.hpp). Others may
/// write meanwhile; the behavior is there when all of it is. Throws BagError or StoreError and
/// leaves the store as it was; what an import leaves that is killed, nobody finds, and the next one
/// drops (Store::beginImport()).
BagImportResult importBags(const std::vector<std::string>& paths, Store& store,
                           const BagImport& import = {});

inline BagImportResult importBag(const std::string& path, Store& store,
                                 const BagImport& import = {}) {
  return importBags({path}, store, import);
}

/// The content of a recording in a file.
struct BagSummary {
  std::vector<TopicSummary> topics;  ///< by name
  std::uint64_t messages = 0;
  Stamp first, last;                 ///< stamps of the first and the last message
  std::vector<std::string> remarks;  ///< BagImportResult's
};

/// Reads a recording from its beginning to its end, as importBags() does. Throws BagError.
BagSummary summarizeBag(const std::string& path, const BagProgress& progress = {});

enum class BagCompression { None, Bz2, Lz4, Zstd };
enum class RecordingFormat { Rosbag, Mcap };

struct BagExport {
  RecordingFormat format = RecordingFormat::Rosbag;
  /// Messages as ROS 2 serializes them, of profile ros2: of an MCAP file. A message that ROS 2 has
  /// not (a time after 2038, an array of no elements) ends the export.
  bool is_ros2 = false;
  /// Bz2 is for rosbags alone, Zstd for MCAP files.
  BagCompression compression = BagCompression::None;
  /// A bag that has about reached this is followed by another: F.bag becomes F_0.bag, F_1.bag, ...
  std::optional<std::uint64_t> split_bytes;
  BagProgress progress;
};

struct BagExportResult {
  std::uint64_t messages = 0;
  std::uint64_t damaged = 0;       ///< messages that the store could not give back
  std::uint64_t unstamped = 0;     ///< messages of stamp 0, which a rosbag has as 1 ns
  std::vector<std::string> paths;  ///< paths of the bags, in order
};

/// Messages of behaviors (MessageRange's rules) as a bag that rosbag reads, or as an MCAP file of
/// profile ros1, with a metadata record "afterglow/behavior" for each of them: bytes, stamps,
/// order, definitions, latching and caller id as they were recorded, but that a rosbag cannot hold
/// the stamp 0 (ros::TIME_MIN), which becomes 1 ns; a message that several
/// behaviors cover is in it once. Written beside `path` and renamed when complete. Throws BagError
/// or StoreError; `path` is then as it was.
BagExportResult exportBags(const Store& store, const std::vector<Behavior>& behaviors,
                           const MessageRange& range, const std::string& path,
                           const BagExport& options = {});

/// Returns the format of a file by its name: Mcap for FILE.mcap, else Rosbag.
RecordingFormat formatOfFile(const std::string& path);

}  // namespace afterglow::replay
