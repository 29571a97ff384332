"""A MongoDB server for one transcript, and what fills it from a folder as mongodump writes it:
DATABASE/COLLECTION.bson, documents one after the other. Speaks the wire protocol (OP_MSG) itself."""
import pathlib
import signal
import socket
import struct
import subprocess
import time


def text(name, value):
    data = value.encode() + b"\0"
    return b"\x02" + name.encode() + b"\0" + struct.pack("<i", len(data)) + data


def document(*elements):
    body = b"".join(elements) + b"\0"
    return struct.pack("<i", len(body) + 4) + body


def ask(connection, body, section=b""):
    """Sends one command, with a section of documents beside it; its answer's bytes."""
    message = struct.pack("<I", 0) + b"\0" + body + section
    connection.sendall(struct.pack("<iiii", len(message) + 16, 1, 0, 2013) + message)
    head = connection.recv(16, socket.MSG_WAITALL)
    answer = connection.recv(struct.unpack("<i", head[:4])[0] - 16, socket.MSG_WAITALL)
    return answer[5:]


def restore(port, folder):
    with socket.create_connection(("127.0.0.1", port)) as connection:
        for path in sorted(pathlib.Path(folder).glob("*/*.bson")):
            documents = path.read_bytes()
            section = b"documents\0" + documents
            answer = ask(connection, document(text("insert", path.stem), text("$db", path.parent.name)),
                         b"\x01" + struct.pack("<i", len(section) + 4) + section)
            if b"writeErrors" in answer or b"errmsg" in answer:
                raise RuntimeError(f"{path}: {answer!r}")


class Server:
    """tests/mongodb/server on a free port, with its data in `folder`, until closed."""

    def __init__(self, program, out, folder):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        data = folder / "mongodb"
        data.mkdir()
        self.process = subprocess.Popen([program, "run", out, str(self.port), data],
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + 30
        while True:
            try:
                socket.create_connection(("127.0.0.1", self.port)).close()
                return
            except OSError:
                if time.monotonic() > deadline or self.process.poll() is not None:
                    raise RuntimeError("the MongoDB server does not answer") from None
                time.sleep(0.01)

    def close(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
