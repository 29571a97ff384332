/// \file
/// Looks a bag over before rosbag_storage reads it, which trusts every length and position in the
/// file. Source of the format: wiki.ros.org/Bags/Format/2.0. Internal to replay.
#pragma once

#include <cstdint>
#include <fstream>
#include <map>
#include <string>

#include "replay/bags/bag_file.hpp"

namespace afterglow::replay {

/// The skeleton of an indexed bag of format 2.0: records that follow each other without a gap to
/// the file's last byte, and positions that point to records of the right kind.
class BagCheck {
 public:
  /// Reads all record headers, but no message. Throws BagError for anything that is not as it
  /// should be: no bag, truncated, never closed, another version.
  explicit BagCheck(const std::string& path);

  /// That a whole message lies at `offset` of the chunk at `chunk_position`, as far as it can be
  /// told without decompressing. Throws BagError.
  void checkMessage(std::uint64_t chunk_position, std::uint32_t offset);

  std::uint64_t messages() const { return messages_; }  ///< how many the index lists

 private:
  using Fields = std::map<std::string, std::string>;
  struct Chunk {
    std::uint64_t data_at = 0;
    std::uint32_t size = 0;  ///< uncompressed
    bool is_plain = true;
  };
  struct Record {
    std::uint64_t at = 0, data_at = 0;
    std::uint32_t data_size = 0;
    Fields fields;
  };

  [[noreturn]] void fail(const std::string& text) const;
  std::string read(std::uint64_t at, std::uint64_t size, const char* what);
  std::uint32_t readLength(std::uint64_t at);
  void readVersion();
  Record readRecord(std::uint64_t at);
  Fields parseFields(const std::string& header, std::uint64_t at) const;
  template <typename T>
  T number(const Record& record, const char* field) const;
  void visit(const Record& record);
  void visitBagHeader(const Record& record);
  void visitChunk(const Record& record);
  void visitIndex(const Record& record);
  void checkPositions() const;

  std::string path_;
  std::ifstream file_;
  std::uint64_t file_size_ = 0;
  std::uint64_t index_position_ = 0;
  std::uint64_t messages_ = 0;
  std::map<std::uint64_t, Chunk> chunks_;        ///< by position of the record
  std::map<std::uint64_t, std::uint8_t> kinds_;  ///< of the records that positions may point to
  std::map<std::uint32_t, bool> connections_;    ///< true: has a record of its own
  std::map<std::uint64_t, std::uint64_t> chunk_infos_;  ///< record -> chunk it is about
};

}  // namespace afterglow::replay
