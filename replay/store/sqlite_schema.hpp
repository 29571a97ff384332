/// \file
/// What a store is on disk, version 2. This page is the format; a change to it is a new version.
///
/// One SQLite 3 database in WAL mode. application_id is 0x4167776c ("Agwl"), user_version the
/// version. All stamps are int64 nanoseconds since the epoch, of ROS time. Intervals are half open.
///
///   definitions   a message definition, once for all recordings
///     id, type "sensor_msgs/PointCloud2", md5 (32 hex digits),
///     text (full, with the contained types behind lines of '=')
///   recordings    a part of the log: one run of a recorder, one imported bag
///     id, source (the recorder's node name, the bag's path)
///   channels      one publisher's connection on one topic, within a recording
///     id, recording, topic, definition (-> definitions), latching 0|1,
///     caller_id ("" if unknown)
///   messages      the log; a message is stored once, however many behaviors cover it
///     id, recording, channel, received_ns, sequence (unique within its recording, increasing in
///     the order of arrival), header_stamp_ns (NULL: no header), document (JSON, see below, or
///     NULL), bytes (exactly as they were received) Read in the order (received_ns, sequence).
///   behaviors     one execution of one behavior: an interval of a recording
///     id, recording, name, tree_path, parent (-> behaviors, 0: none), attempt, outcome ("" while
///     it runs), begin_ns, end_ns (NULL: running, or its recorder died; it then reaches to the
///     recording's last message), robot, parameters (JSON object), tags (JSON array of strings),
///     calibration (JSON object), topics (JSON array: the topics that belong to it, heard or not)
///     Its messages are those of its recording in [begin_ns, end_ns) on its topics; others on
///     other topics are context (/tf, /tf_static, ...).
///
/// A document is replay/messages/document.hpp's JSON of the bytes, for queries by value. Number
/// arrays longer than 64 are {"type", "count"} in it. It is NULL when the bytes do not fit the
/// definition, and when it would be longer than 1 MiB: the bytes have it all.
#pragma once

#include <memory>
#include <string>

#include "replay/store/sqlite.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

constexpr int kStoreVersion = 2;

/// A connection to the store in the file `path` (":memory:": a new one in memory). ReadWrite makes
/// file, folders and tables where there are none. Throws StoreError, and leaves the file as it was,
/// if it is something else than a store of this version.
std::unique_ptr<SqliteConnection> openSqliteStore(const std::string& path, OpenMode mode);

}  // namespace afterglow::replay
