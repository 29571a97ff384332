/// \file
/// The format of a store on a MongoDB server, version 1; a change to this page is a new
/// version. All stamps are int64 nanoseconds since the epoch, of ROS time; intervals are half open.
///
/// Database D (the URI's; "roslog" by default) holds messages alone, as mongodb_log lays them out:
/// mongodb_play plays every collection of its database.
///   a collection a topic, named as mongodb_log names it: "/" becomes "_", the first character is
///   dropped. Topics that come to share a name (/a/b, /a_b) share a collection; _meta.topic tells.
///     _id      {robot, recording (key), sequence}: a message that is sent twice is there once
///     the message's fields (replay/messages/bson_document.hpp)
///     _meta    mongodb_log's: topic, latch, inserted_at (date, ms), stored_class, stored_type;
///              ours: recording (key), robot, received_ns, sequence, header_ns (if it has a
///              header), channel, md5, bytes (Binary, exactly as received) or file (id in GridFS);
///              reduced (true): the fields are not whole, ask the bytes. The document would be
///              larger than 15 MiB, or the server refused them (not finite, nested too deep): then
///              long arrays are {type, count}, numbers that are not finite are texts, or the fields
///              are left out. The bytes are always whole.
///   index: _meta.recording, _meta.received_ns, _meta.sequence
///
/// Database D_afterglow holds the rest:
///   store        {_id: "format", version}
///   counters     {_id: "recordings"|"channels"|"behaviors", last}: the numbers given out so far
///   recordings   {_id, key, source, robot, import_until (date; only while it is imported: then no
///                behavior is of it, and whoever imports it puts this off again and again)}
///   definitions  {_id (MD5 and a checksum of type and text), type, md5, text}
///   channels     {_id, recording, topic, definition, latching, caller_id}
///   behaviors    {_id, key, recording, name, tree_path, parent, attempt, outcome, begin_ns,
///                end_ns (null: open), wall_begin_ns, robot, parameters, tags, calibration, topics,
///                snapshot, remarks}; objects as JSON text
///   fs.files, fs.chunks   GridFS: large messages ("RECORDING KEY/SEQUENCE"), files (their SHA-256)
#pragma once

#include <memory>
#include <string>

#include "replay/messages/schema.hpp"
#include "replay/store/mongo/mongo_bson.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

constexpr int kMongoVersion = 1;

/// A document may have 16 MiB; the rest is room for the server.
constexpr std::size_t kLargestMongoDocument = 15 << 20;

/// A channel with everything that is needed to store and read its messages.
struct MongoChannel {
  std::int64_t id = 0;
  Recording recording;
  Channel channel;
  std::string collection;
  std::shared_ptr<const Schema> schema;  ///< null: the definition cannot be understood
};

/// mongodb_log's name for the collection of a topic: "/a/b" -> "a_b".
std::string collectionOf(const std::string& topic);

enum class MongoFields { All, Reduced, None };

struct MongoDocument {
  Bson bson;
  std::string file;  ///< id in GridFS under which the bytes belong; empty: they are in the document
};

/// The document of a message with at most these fields; with fewer if it would grow too large.
MongoDocument toMongo(const Message& message, const MongoChannel& channel, MongoFields fields,
                      bool takes_non_finite);

/// The message but for bytes that are in GridFS, whose id is then in `file`. Throws StoreError for
/// a document that lacks what Afterglow writes.
Message fromMongo(const bson_t& document, std::string& file);

Bson toMongo(const Behavior& behavior);
Behavior behaviorFromMongo(const bson_t& document);

}  // namespace afterglow::replay
