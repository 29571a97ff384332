"""Reads a store without ROS and without the command, as in a notebook: by Python 3, its SQLite, and NumPy.

    from afterglow.reader import Store

    with Store("behaviors.db") as store:
        pick = store.behaviors(name="pick", outcome="dropped")[0]
        for topic, message, received_ns in pick.messages(["/joint_states"]):
            message["position"]          # a NumPy array; a nested message is a dictionary
"""
import collections
import json
import os
import sqlite3
import urllib.parse
import warnings

from .decoding import Definition, MessageError
from .store import Behavior, StoreError

#: received_ns: nanoseconds since the epoch, of ROS time.
Message = collections.namedtuple("Message", "topic message received_ns")

# replay/store/sqlite/sqlite_schema.hpp explains tables and versions.
_APPLICATION_ID, _VERSIONS, _END_OF_TIME = 0x4167776c, (2, 3), 2 ** 63 - 1
_PAGE = 1000  # no read lasts longer: a recorder that writes meanwhile needs its log's end
_COLUMNS = "id, name, tree_path, parent, attempt, outcome, begin_ns, end_ns, robot, parameters, tags"


class Store(object):
    """A SQLite store: a path, by default the command's, $AFTERGLOW_STORE. Raises StoreError.

    It may be recorded into meanwhile. Sizes of messages are checked, checksums are not: `afterglow store check` does.
    """

    def __init__(self, path=None):
        path = path or os.environ.get("AFTERGLOW_STORE") or "~/.local/share/afterglow/afterglow.db"
        self.path = os.path.expanduser(os.fspath(path))
        if self.path.startswith("sqlite:"):
            self.path = self.path[len("sqlite:"):]
        if not os.path.isfile(self.path):
            raise StoreError(self.path + ": no such store; a server's is read by the command afterglow")
        self._connection = sqlite3.connect(_uri(self.path), uri=True)
        self._connection.text_factory = lambda text: text.decode("utf-8", "replace")
        self._channels, self._definitions = {}, {}
        try:
            self._check()
        except StoreError:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._connection.close()

    def behaviors(self, name=None, outcome=None, id=None):
        """Those of this name, this outcome, this id, newest first: StoredBehavior. Raises StoreError."""
        asked = [(column, value) for column, value in (("name", name), ("outcome", outcome), ("id", id))
                 if value is not None]
        where = "".join(" AND {} = ?".format(column) for column, _ in asked)
        rows = self.rows("SELECT {}, topics, recording FROM behaviors WHERE 1{} ORDER BY begin_ns DESC, id DESC".format(
            _COLUMNS, where), [value for _, value in asked])
        return [StoredBehavior(self, row) for row in rows]

    def rows(self, sql, values=()):
        """All rows of a query. Raises StoreError."""
        try:
            return self._connection.execute(sql, values).fetchall()
        except sqlite3.Error as error:
            raise StoreError("{}: {}".format(self.path, error))

    def decoded(self, channel, message):
        """The topic, and the message of this row decoded. Raises MessageError, whose text names the topic."""
        if channel not in self._channels:
            self._channels[channel] = self.rows(
                "SELECT topic, type, text, d.id FROM channels c JOIN definitions d ON d.id = c.definition "
                "WHERE c.id = ?", (channel,))[0]
        topic, type, text, definition = self._channels[channel]
        try:
            if definition not in self._definitions:
                self._definitions[definition] = Definition(type, text)
            return topic, self._definitions[definition].decode(self._bytes(message))
        except MessageError as error:
            raise MessageError("{}: {}".format(topic, error))

    def _check(self):
        if self.rows("PRAGMA application_id")[0][0] != _APPLICATION_ID:
            raise StoreError(self.path + ": not an Afterglow store")
        version = self.rows("PRAGMA user_version")[0][0]
        if version not in _VERSIONS:
            raise StoreError("{}: the store has version {}, this module reads {} and {}; \"afterglow store compact\" "
                             "makes an older one new".format(self.path, version, *_VERSIONS))
        # What could run when it is read.
        foreign = self.rows("SELECT type, name FROM sqlite_master WHERE type IN ('trigger', 'view') "
                            "OR sql LIKE 'CREATE VIRTUAL%' LIMIT 1")
        if foreign:
            raise StoreError("{}: not an Afterglow store: it holds the {} {}".format(self.path, *foreign[0]))

    def _bytes(self, message):
        size, data = self.rows("SELECT size, bytes FROM messages WHERE id = ?", (message,))[0]
        if data is None:
            data = b"".join(chunk for chunk, in self.rows(
                "SELECT bytes FROM chunks WHERE message = ? ORDER BY number", (message,)))
        if len(data) != size:
            raise MessageError("{} of {} bytes are there".format(len(data), size))
        return data


class StoredBehavior(Behavior):
    """A Behavior, and begin_ns and end_ns. outcome is "" and end None while it is recorded, or if that was cut off."""

    def __init__(self, store, row):
        told = dict(zip(_COLUMNS.split(", "), row))
        told.update(parameters=_json(told["parameters"], dict), tags=_json(told["tags"], list))
        self._reader, self._recording, self._names = store, row[-1], _json(row[-2], list)
        told["topics"] = self._counts(told["id"])
        Behavior.__init__(self, told, store.path)
        self.begin_ns, self.end_ns = told["begin_ns"], told["end_ns"]

    def messages(self, topics=None):
        """Its messages in the order of their times, each a Message, while the store is open.

        topics: these instead of its own; context such as "/tf" may be named. One that cannot be read or decoded is
        left out, with a warning. Raises StoreError.
        """
        names = self._names if topics is None else list(topics)
        channels = [channel for channel, topic in self._reader.rows(
            "SELECT id, topic FROM channels WHERE recording = ?", (self._recording,)) if topic in names]
        end_ns = _END_OF_TIME if self.end_ns is None else self.end_ns
        at = (self.begin_ns, -1, -1)
        while True:
            page = self._reader.rows(
                "SELECT received_ns, sequence, channel, id FROM messages WHERE recording = ? "
                "AND (received_ns, sequence, channel) > (?, ?, ?) AND received_ns < ? "
                "ORDER BY received_ns, sequence, channel LIMIT ?", (self._recording,) + at + (end_ns, _PAGE))
            for received_ns, _, channel, message in page:
                if channel not in channels:
                    continue
                try:
                    topic, decoded = self._reader.decoded(channel, message)
                    yield Message(topic, decoded, received_ns)
                except MessageError as error:
                    warnings.warn("{}: left out, at {}: {}".format(self._reader.path, received_ns, error))
            if len(page) < _PAGE:
                return
            at = page[-1][:3]

    def _counts(self, behavior):
        """As `afterglow list --json` tells them; of several types on a topic the most frequent."""
        counted = {}
        for topic, type, count in self._reader.rows(
                "SELECT topic, type, sum(count) AS n FROM behavior_counts JOIN channels c ON c.id = channel "
                "JOIN definitions d ON d.id = definition WHERE behavior = ? GROUP BY topic, type "
                "ORDER BY n DESC, type", (behavior,)):
            if topic in self._names:
                first = counted.setdefault(topic, {"type": type, "count": 0})
                first["count"] += count
        return counted


def _json(text, kind):
    """Text of a damaged store may be anything."""
    try:
        value = json.loads(text)
    except ValueError:
        value = None
    return value if isinstance(value, kind) else kind()


def _uri(path):
    """SQLite opens a store that nobody can write, as on a DVD, only if told that it does not change."""
    real = os.path.realpath(path)
    has_log = os.path.exists(real + "-wal") and os.path.getsize(real + "-wal") > 0
    frozen = not has_log and not os.access(os.path.dirname(real), os.W_OK)
    return "file:{}?mode=ro{}".format(urllib.parse.quote(real), "&immutable=1" if frozen else "")
