#include "replay/store/mongo/mongo_blobs.hpp"

#include <algorithm>

#include "replay/store/checksum.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {
namespace {

constexpr std::size_t kChunkBytes = 4 << 20;
constexpr const char* kFiles = "fs.files";
constexpr const char* kChunks = "fs.chunks";

std::int64_t checksum(const Bytes& bytes) { return checksumOf(bytes.data(), bytes.size()); }

Bson ofFile(const std::string& id) { return Bson().add("files_id", id); }

}  // namespace

void MongoBlobs::makeIndexes() const {
  client_.makeIndex(database_, kChunks, {"files_id", "n"}, true);
}

void MongoBlobs::put(const std::string& id, const Bytes& contents) const {
  for (std::size_t n = 0; n * kChunkBytes < contents.size(); ++n) {
    const std::size_t begin = n * kChunkBytes;
    const std::size_t size = std::min(kChunkBytes, contents.size() - begin);
    Bson chunk;
    chunk.add("_id", id + "/" + std::to_string(n)).add("files_id", id);
    bson_append_int32(&chunk.raw(), "n", -1, static_cast<std::int32_t>(n));
    client_.upsert(database_, kChunks, chunk.addBinary("data", contents.data() + begin, size));
  }
  Bson file = withId(id);
  file.add("length", static_cast<std::int64_t>(contents.size()));
  bson_append_int32(&file.raw(), "chunkSize", -1, kChunkBytes);
  file.addDate("uploadDate", wallClock_ms()).add("filename", id);
  file.add("metadata", Bson().add("xxh3", checksum(contents)));
  client_.upsert(database_, kFiles, file);
}

std::optional<Bytes> MongoBlobs::get(const std::string& id) const {
  const auto file = client_.findOne(database_, kFiles, withId(id));
  if (!file) return std::nullopt;
  Bytes contents;
  const Bson options = Bson().add("sort", Bson().add("n", 1));
  client_.find(database_, kChunks, ofFile(id), options, [&](const bson_t& chunk) {
    const auto data = bytesAt(chunk, "data");
    if (data) contents.insert(contents.end(), data->begin(), data->end());
    return true;
  });
  if (integerAt(file->raw(), "length") != static_cast<std::int64_t>(contents.size()) ||
      integerAt(file->raw(), "metadata.xxh3") != checksum(contents)) {
    client_.fail("read the file " + id, "its chunks are damaged: length or checksum differ");
  }
  return contents;
}

bool MongoBlobs::contains(const std::string& id) const {
  return client_.findOne(database_, kFiles, withId(id)).has_value();
}

void MongoBlobs::remove(const std::string& id) const {
  client_.remove(database_, kFiles, withId(id));
  client_.remove(database_, kChunks, ofFile(id));
}

}  // namespace afterglow::replay
