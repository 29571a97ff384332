"""Messages of ROS 1 as dictionaries, by the definitions that a store keeps: replay/messages/schema.hpp in Python."""
import re
import struct

import numpy

_NUMBERS = {"bool": "?", "int8": "i1", "byte": "i1", "uint8": "u1", "char": "u1", "int16": "i2", "uint16": "u2",
            "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8"}
_CODES = {"?": "B", "i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q", "f4": "f",
          "f8": "d"}
_STAMPS = {"time": struct.Struct("<II"), "duration": struct.Struct("<ii")}
_FIELD = re.compile(r"([A-Za-z]\w*(?:/[A-Za-z]\w*)?)(\[(\d*)\])?\s+([A-Za-z]\w*)\Z", re.ASCII)
_HEADER = ["uint32 seq", "time stamp", "string frame_id"]
_COUNT = struct.Struct("<I")
# A real message is far below these; a hostile definition shall take neither stack nor time.
_DEEPEST, _MOST_FIELDS, _MOST_EMPTY = 64, 8192, 64


class MessageError(ValueError):
    """A definition that cannot be understood, or bytes that do not fit it."""


class Definition(object):
    """Decodes messages of a type, "sensor_msgs/LaserScan", by its full text. Raises MessageError.

    A message is a dictionary of its fields; an array of numbers is a NumPy array over the message's own bytes, which
    cannot be written; a time is {"secs", "nsecs"}; of a string that is no UTF-8 each bad byte becomes U+FFFD.
    """

    def __init__(self, type, text):
        self._type, self._parts, self._known, self._path = type, _parts(type, text), {}, []
        self._root = self._message(type)

    def decode(self, data):
        """The message of these bytes. Raises MessageError."""
        try:
            message, end = self._root.read(data, 0)
        except (struct.error, IndexError, ValueError) as error:
            raise MessageError("{}: {}".format(self._type, error))
        if end != len(data):
            raise MessageError("{}: {} bytes are left behind the last field".format(self._type, len(data) - end))
        return message

    def _message(self, type):
        if type in self._known:
            return self._known[type]
        if type in self._path or len(self._path) >= _DEEPEST:
            raise MessageError("definition of {}: {} contains itself, or too much".format(self._type, type))
        self._path.append(type)
        fields = [self._field(type, line) for line in self._parts[type]]
        self._path.pop()
        reads = [(name, part.read) for name, part in fields]

        def read(data, at):
            message = {}
            for name, one in reads:
                message[name], at = one(data, at)
            return message, at
        made = _Part(read, sum(part.least for _, part in fields), 1 + sum(part.fields for _, part in fields),
                     sum(part.empty for _, part in fields) if fields else 1)
        if made.fields > _MOST_FIELDS or made.empty > _MOST_EMPTY:
            raise MessageError("definition of {}: {} has too many fields".format(self._type, type))
        self._known[type] = made
        return made

    def _field(self, owner, line):
        declared = _FIELD.match(line)
        if not declared:
            raise MessageError("definition of {}: \"{}\" is no field".format(self._type, line))
        kind, brackets, length, name = declared.groups()
        if kind in _NUMBERS and brackets:
            return name, _numbers(_NUMBERS[kind], length)
        part = _single(kind) or self._message(self._resolved(owner, kind))
        return name, _array(part, length) if brackets else part

    def _resolved(self, owner, kind):
        if kind == "Header":
            kind = "roslib/Header" if "roslib/Header" in self._parts else "std_msgs/Header"
        elif "/" not in kind:
            kind = owner.split("/")[0] + "/" + kind
        if kind in ("roslib/Header", "std_msgs/Header"):
            self._parts.setdefault(kind, _HEADER)
        if kind not in self._parts:
            raise MessageError("definition of {}: that of {} is missing".format(self._type, kind))
        return kind


class _Part(object):
    """read(data, at): a value and where it ends. least: its fewest bytes. fields, empty: those in it, without bytes."""

    def __init__(self, read, least, fields=1, empty=0):
        self.read, self.least, self.fields, self.empty = read, least, fields, empty


def _parts(type, text):
    """The lines that declare fields, by type."""
    parts = {type: []}
    for line in text.splitlines():
        line = line.split("#")[0].strip()
        if line.startswith("==") and not line.strip("="):
            type = None
        elif type is None and line.startswith("MSG:"):
            type = line[4:].strip()
            parts[type] = []
        elif line and type is not None and "=" not in line:  # a constant has one
            parts[type].append(line)
    return parts


def _single(kind):
    """A number, text or stamp; else None."""
    if kind in _NUMBERS:
        number = struct.Struct("<" + _CODES[_NUMBERS[kind]])
        if kind == "bool":
            return _Part(lambda data, at: (number.unpack_from(data, at)[0] != 0, at + 1), 1)
        return _Part(lambda data, at: (number.unpack_from(data, at)[0], at + number.size), number.size)
    if kind in _STAMPS:
        stamp = _STAMPS[kind]
        return _Part(lambda data, at: (dict(zip(("secs", "nsecs"), stamp.unpack_from(data, at))), at + 8), 8)
    return _Part(_text, 4) if kind == "string" else None


def _text(data, at):
    end = at + 4 + _COUNT.unpack_from(data, at)[0]
    if end > len(data):
        raise MessageError("a string ends {} bytes behind the message".format(end - len(data)))
    text = data[at + 4:end].decode("utf-8", "surrogateescape")
    return re.sub("[\udc80-\udcff]", "\ufffd", text), end


def _numbers(code, length):
    dtype = numpy.dtype("u1" if code == "?" else "<" + code)

    def read(data, at):
        count, at = (int(length), at) if length else (_COUNT.unpack_from(data, at)[0], at + 4)
        end = at + count * dtype.itemsize
        if end > len(data):
            raise MessageError("an array ends {} bytes behind the message".format(end - len(data)))
        numbers = numpy.frombuffer(data, dtype, count, at) if count else numpy.empty(0, dtype)
        return (numbers != 0 if code == "?" else numbers), end
    return _Part(read, int(length) * dtype.itemsize if length else 4)


def _array(part, length):
    def read(data, at):
        count, at = (int(length), at) if length else (_COUNT.unpack_from(data, at)[0], at + 4)
        if count * max(part.least, 1) > len(data) - at:
            raise MessageError("an array counts {} elements; {} bytes are left".format(count, len(data) - at))
        elements = []
        for _ in range(count):
            element, at = part.read(data, at)
            elements.append(element)
        return elements, at
    return _Part(read, int(length) * part.least if length else 4, part.fields, part.empty)
