/// \file
/// Bytes that are too large for a document, in chunks: GridFS (github.com/mongodb/specifications,
/// gridfs-spec), bucket "fs". Every tool that knows GridFS reads it.
#pragma once

#include <optional>
#include <string>

#include "replay/store/mongo/mongo_client.hpp"

namespace afterglow::replay {

/// Files of a GridFS bucket under ids of their own, so that storing one again changes nothing.
/// The client must outlive it. Throws StoreError.
class MongoBlobs {
 public:
  MongoBlobs(const MongoClient& client, std::string database)
      : client_(client), database_(std::move(database)) {}

  void makeIndexes() const;
  /// The file itself comes last: one that was broken off is not there.
  void put(const std::string& id, const Bytes& contents) const;
  /// Empty if there is no such file; throws if length or checksum differ from those of put().
  std::optional<Bytes> get(const std::string& id) const;
  bool contains(const std::string& id) const;
  void remove(const std::string& id) const;

 private:
  const MongoClient& client_;
  std::string database_;
};

}  // namespace afterglow::replay
