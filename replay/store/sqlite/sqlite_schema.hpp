/// \file
/// The format of a store on disk, version 3. A change of it is a new version.
///
/// One SQLite 3 database in WAL mode, pages of 16 KiB. application_id is 0x4167776c ("Agwl"),
/// user_version the version. All stamps are int64 nanoseconds since the epoch, of ROS time unless
/// said otherwise. Intervals are half open. A key is 32 hex digits, the same in every store that
/// its row is copied to. A checksum is XXH3 of 64 bits with seed 0, as a signed integer.
///
///   definitions   a message definition, once for all recordings
///     id, type "sensor_msgs/PointCloud2", md5 (32 hex digits),
///     text (full, with the contained types behind lines of '=')
///   recordings    a part of the log: one run of a recorder, one imported bag
///     id, key, source (the recorder's node name, the bag's path), robot
///   channels      one publisher's connection on one topic, within a recording
///     id, recording, topic, definition (-> definitions), latching 0|1,
///     caller_id ("" if unknown)
///   messages      the log; a message is stored once, however many behaviors cover it
///     id, recording, channel, received_ns, sequence (unique within its recording, increasing in
///     the order of arrival), header_stamp_ns (NULL: no header), size and checksum of the bytes,
///     bytes (exactly as they were received; NULL: in chunks)
///     Read in the order (received_ns, sequence).
///   chunks        the bytes of messages above 4 MiB, in pieces of 4 MiB, the last one shorter
///     message, number (from 0), checksum, bytes
///   behaviors     one execution of one behavior: an interval of a recording
///     id, key, recording, name, tree_path, parent (-> behaviors, 0: none), attempt, outcome (""
///     while it runs), begin_ns, end_ns (NULL: running, or its recorder died; it then reaches to
///     the recording's last message), wall_begin_ns (wall clock, 0: unknown), robot, parameters
///     (JSON object), tags (JSON array of strings), calibration (JSON object), topics (JSON array:
///     the topics that belong to it, heard or not), snapshot (JSON object: record/snapshot.hpp),
///     remarks (JSON array of sentences). Its messages are those of its recording in [begin_ns,
///     end_ns) on its topics; those on other topics are its context (/tf, /tf_static, ...).
///   behavior_counts  how many messages of each channel lie in a behavior's interval; made from
///                    messages
///     behavior, channel, count, first_ns, last_ns
///   imports       recordings that are being imported and have no behavior yet. The table is made
///                 by the first import. A lock on byte `recording` of the file PATH.imports tells
///                 that an import's program lives (store_files.hpp)
///     recording
///   files         contents of files that behaviors refer to
///     sha256 (64 hex digits), contents
///
/// Version 1 had no keys, robot of a recording, wall_begin_ns, snapshot, remarks, checksums,
/// chunks, counts and files, and kept each message's decoded fields beside it. Version 2 had a
/// table field_blocks besides, an index that queries no longer need. Opened for writing an older
/// store is made into version 3, in one transaction.
#pragma once

#include <memory>
#include <string>

#include "replay/store/sqlite/sqlite.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

constexpr int kStoreVersion = 3;
constexpr int kOldestReadVersion = 2;  ///< an older one is not read without being made into this
constexpr std::size_t kSqliteChunkBytes = 4 << 20;

/// A connection to the store in the file `path` (":memory:": a new one in memory). ReadWrite makes
/// a missing file with its folders and tables, and brings an older store to this version. Throws
/// StoreError, and leaves the file as it was, if it is not a store.
std::unique_ptr<SqliteConnection> openSqliteStore(const std::string& path, OpenMode mode);

}  // namespace afterglow::replay
