#!/usr/bin/python3
"""Judges bags by rosbag's own Python reader, which shares no code with Afterglow.

bag_judge.py same A B       B holds A's messages: bytes, order, stamps, definitions, latching, caller ids
bag_judge.py values BAG     stdin (`afterglow show ID --messages`) tells each message's fields as rosbag does
"""
import json
import sys

import genpy
import rosbag


def messages(path):
    """(stamp, topic, type, md5, bytes, definition, latching, caller id), by stamp, then position in the file."""
    rows = []
    with rosbag.Bag(path) as bag:
        for topic, (kind, data, md5, position, _), stamp, header in bag.read_messages(
                raw=True, return_connection_header=True):
            rows.append(((stamp.to_nsec(), position), topic, kind, md5, data, header["message_definition"],
                         header.get("latching", b"0"), header.get("callerid", b"")))
    rows.sort(key=lambda row: row[0])
    return [(row[0][0],) + row[1:] for row in rows]


def same(a, b):
    first, second = messages(a), messages(b)
    if len(first) != len(second):
        return f"{len(first)} messages in {a}, {len(second)} in {b}"
    for i, (x, y) in enumerate(zip(first, second)):
        if x != y:
            return f"message {i} differs:\n{x}\n{y}"
    print(f"{len(first)} messages are the same")


def plain(value):
    if isinstance(value, genpy.Message):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, (genpy.Time, genpy.Duration)):
        return {"secs": value.secs, "nsecs": value.nsecs}
    if isinstance(value, (bytes, list, tuple)):
        return [plain(element) for element in value]
    return value


def values(path):
    lines = [json.loads(line) for line in sys.stdin]
    count = 0
    with rosbag.Bag(path) as bag:
        for i, (topic, message, stamp) in enumerate(bag.read_messages()):
            if i == len(lines):
                return f"only {i} lines"
            expected = (topic, stamp.to_nsec(), plain(message))
            found = (lines[i]["topic"], int(lines[i]["received_ns"]), lines[i]["message"])
            if found != expected:
                return f"message {i} differs:\n{expected}\n{found}"
            count += 1
    if count != len(lines):
        return f"{len(lines)} lines for {count} messages"
    print(f"{count} messages have the same values")


if __name__ == "__main__":
    sys.exit({"same": same, "values": values}[sys.argv[1]](*sys.argv[2:]))
