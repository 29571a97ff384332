/// \file
/// Writes MCAP files with chunks, indexes, summary and checksums, as Foxglove and the MCAP
/// libraries read them. Internal to replay.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "replay/bags/mcap_records.hpp"

namespace afterglow::replay {

/// Throws BagError naming the file that it is written for.
class McapWriter {
 public:
  /// Writes the file `path`, which errors call `name`.
  McapWriter(const std::string& path, std::string name, const std::string& profile,
             Packing packing);
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;
  ~McapWriter();

  std::uint16_t addSchema(const McapSchema& schema);
  std::uint16_t addChannel(const McapChannel& channel);
  void write(std::uint16_t channel, std::uint32_t sequence, std::uint64_t log_time,
             const Bytes& data);
  void addMetadata(const std::string& name, const std::map<std::string, std::string>& entries);
  std::uint64_t size() const { return size_ + chunk_.size(); }  ///< approximately
  /// Writes the rest, and has the disk keep it.
  void close();

 private:
  using IndexEntries = std::vector<std::pair<std::uint64_t, std::uint64_t>>;  // time, offset
  struct Interval {
    std::uint64_t begin = 0, end = 0;
    bool is_empty = true;
    void add(std::uint64_t time);
  };

  void put(const Bytes& bytes);
  void endChunk();
  void putSummary();
  [[noreturn]] void fail(const std::string& reason) const;

  const std::string name_;
  const Packing packing_;
  int file_ = -1;
  std::uint64_t size_ = 0;
  std::uint32_t checksum_ = 0;  ///< checksum of all that is written
  Bytes chunk_;
  Interval chunk_times_, times_;
  std::map<std::uint16_t, IndexEntries> chunk_index_;  ///< indices by channel
  std::vector<Bytes> schemas_, channels_;              ///< records of schemas and channels
  std::map<std::uint16_t, std::uint64_t> counts_;      ///< counts of messages, by channel
  std::uint64_t message_count_ = 0;
  std::vector<Bytes> chunk_indexes_, metadata_indexes_;  ///< records of the summary
};

}  // namespace afterglow::replay
