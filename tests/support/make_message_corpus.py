#!/usr/bin/env python3
"""Writes messages as ROS's own Python serializes them, to hold our reading of them against.

usage: make_message_corpus.py OUT [SEED]

OUT gets one JSON object a line: {"type", "definition", "md5", "messages": [{"bytes" (hex), "values"}]}.
Values are laid out as replay/messages/document.hpp's toJson says. The last line is {"missing": [packages]}.
Every type of PACKAGES is filled with its defaults once and with seeded random values several times.
Exit status 3: this Python has no genpy, or none of the packages.
"""
import importlib
import io
import json
import math
import random
import struct
import sys

try:
    import genpy
    from genpy.message import get_message_class
except ImportError:
    sys.exit(3)

PACKAGES = [
    'actionlib', 'actionlib_msgs', 'diagnostic_msgs', 'geometry_msgs', 'nav_msgs', 'rosgraph_msgs',
    'sensor_msgs', 'shape_msgs', 'std_msgs', 'stereo_msgs', 'tf2_msgs', 'trajectory_msgs',
    'visualization_msgs']
RANDOM_MESSAGES = 4

INTEGERS = {
    'int8': (-2**7, 2**7 - 1), 'byte': (-2**7, 2**7 - 1), 'uint8': (0, 2**8 - 1),
    'char': (0, 2**8 - 1), 'int16': (-2**15, 2**15 - 1), 'uint16': (0, 2**16 - 1),
    'int32': (-2**31, 2**31 - 1), 'uint32': (0, 2**32 - 1), 'int64': (-2**63, 2**63 - 1),
    'uint64': (0, 2**64 - 1)}
STRINGS = ['', 'map', 'base_link', 'Grüße, 世界', '\0', 'a' * 300, '{"quoted": "\\"}', '🤖']


def random_float(rng, code):
    special = [0.0, -0.0, math.nan, math.inf, -math.inf, 1e-45, 3e38]
    value = rng.choice(special) if rng.random() < 0.2 else rng.gauss(0, 1000)
    return struct.unpack(code, struct.pack(code, value))[0]


def random_scalar(rng, kind):
    if kind in INTEGERS:
        low, high = INTEGERS[kind]
        return rng.choice([low, high, 0, rng.randint(low, high)])
    if kind == 'bool':
        return rng.random() < 0.5
    if kind == 'float32':
        return random_float(rng, '<f')
    if kind == 'float64':
        return random_float(rng, '<d')
    if kind == 'string':
        return rng.choice(STRINGS)
    if kind == 'time':
        return genpy.Time(rng.choice([0, rng.randint(0, 2**32 - 1)]), rng.randint(0, 10**9 - 1))
    if kind == 'duration':
        return genpy.Duration(rng.randint(-2**31, 2**31 - 1), rng.randint(0, 10**9 - 1))
    return filled(rng, get_message_class(kind)())


def random_value(rng, kind):
    if not kind.endswith(']'):
        return random_scalar(rng, kind)
    kind, length = kind[:-1].split('[')
    count = int(length) if length else rng.choice([0, 1, 2, 7])
    if kind in ('uint8', 'char'):
        return bytes(random_scalar(rng, kind) for _ in range(count))
    return [random_scalar(rng, kind) for _ in range(count)]


def filled(rng, message):
    for name, kind in zip(message.__slots__, message._slot_types):
        setattr(message, name, random_value(rng, kind))
    return message


def to_json(value):
    if isinstance(value, genpy.Message):
        return {name: to_json(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, (genpy.Time, genpy.Duration)):
        return {'secs': value.secs, 'nsecs': value.nsecs}
    if isinstance(value, (list, tuple, bytes)):
        return [to_json(element) for element in value]
    if isinstance(value, float) and not math.isfinite(value):
        return 'nan' if math.isnan(value) else 'inf' if value > 0 else '-inf'
    return value


def entry(message):
    buffer = io.BytesIO()
    message.serialize(buffer)
    return {'bytes': buffer.getvalue().hex(), 'values': to_json(message)}


def types(package):
    module = importlib.import_module(package + '.msg')
    found = [c for c in vars(module).values()
             if isinstance(c, type) and issubclass(c, genpy.Message)]
    return sorted((c for c in found if c._type.startswith(package + '/')), key=lambda c: c._type)


def main():
    rng = random.Random(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    missing = []
    with open(sys.argv[1], 'w', encoding='utf-8') as out:
        for package in PACKAGES:
            try:
                classes = types(package)
            except ImportError:
                missing.append(package)
                continue
            for cls in classes:
                messages = [cls()] + [filled(rng, cls()) for _ in range(RANDOM_MESSAGES)]
                json.dump({'type': cls._type, 'definition': cls._full_text, 'md5': cls._md5sum,
                           'messages': [entry(m) for m in messages]}, out, ensure_ascii=False)
                out.write('\n')
        out.write(json.dumps({'missing': missing}) + '\n')
    if len(missing) == len(PACKAGES):
        sys.exit(3)


if __name__ == '__main__':
    main()
