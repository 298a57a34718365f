"""A client of the live view's protocol (docs/file_formats.md, Live view)."""
import json
import select
import socket
import struct
import time
from base64 import b64encode
from os import urandom

KINDS = {1: "hello", 2: "page", 3: "gone", 4: "pose", 5: "path", 6: "scan", 8: "tile", 9: "telemetry", 10: "event", 11: "picture", 12: "statistics"}


class Viewer:
    """A viewer of /live, which takes at most `bytes_per_s` (0: all that comes)."""

    def __init__(self, port, bytes_per_s=0):
        self.bytes_per_s, self.received, self.start = bytes_per_s, 0, time.monotonic()
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=20)
        key = b64encode(urandom(16)).decode()
        self.socket.sendall((f"GET /live HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                             f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n").encode())
        self.bytes = b""
        while b"\r\n\r\n" not in self.bytes:
            self.bytes += self.socket.recv(4096)
        self.bytes = self.bytes.split(b"\r\n\r\n", 1)[1]
        self.pages, self.last, self.counts, self.acked, self.pending = {}, {}, {}, 0.0, 0
        self.events, self.kinds = [], set()  # kinds of paths and scans: (name, which)
        self.send({"type": "hello", "protocol": 1, "session": "", "pages": [], "more": False})

    def close(self):
        self.socket.close()

    def send(self, message):
        self.frame(1, json.dumps(message).encode())

    def acknowledge(self):
        self.acked = time.monotonic()
        self.send({"type": "ack", "sequence": self.pending})
        self.pending = 0

    def frame(self, code, content):
        mask = urandom(4)
        length = bytes([0x80 | len(content)]) if len(content) < 126 else b"\xfe" + struct.pack(">H", len(content))
        self.socket.sendall(bytes([0x80 | code]) + length + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(content)))

    def take(self, count):
        while len(self.bytes) < count:
            # What has come is acknowledged before anything is waited for: the server waits too.
            if self.pending and not select.select([self.socket], [], [], 0.02)[0]:
                self.acknowledge()
            more = self.socket.recv(1 << 14 if self.bytes_per_s else 1 << 16)
            if not more:
                raise EOFError
            self.bytes += more
            self.received += len(more)
            if self.bytes_per_s:
                time.sleep(max(0.0, self.received / self.bytes_per_s - (time.monotonic() - self.start)))
        taken, self.bytes = self.bytes[:count], self.bytes[count:]
        return taken

    def read(self):
        """One frame; None at the end of the connection."""
        try:
            first, length = self.take(2)
            length &= 127
            if length == 126:
                length = struct.unpack(">H", self.take(2))[0]
            elif length == 127:
                length = struct.unpack(">Q", self.take(8))[0]
            content = self.take(length)
        except (EOFError, ConnectionError):
            return None
        if first & 15 == 9:
            self.frame(10, content)
        if first & 15 == 8:
            return None
        if first & 15 != 2:
            return ""
        version, kind, _, sequence, _ = struct.unpack("<BBHIq", content[:16])
        assert version == 1
        self.pending = sequence
        if time.monotonic() - self.acked > 0.02:
            self.acknowledge()
        return self.note(KINDS.get(kind, "other"), content[16:])

    def note(self, name, payload):
        self.counts[name] = self.counts.get(name, 0) + 1
        if name == "page":
            x, y, z, page_version = struct.unpack("<iiiI", payload[:16])
            self.pages[x, y, z] = (page_version, payload[16], struct.unpack("<I", payload[24:28])[0] // 3)
        elif name == "gone":
            self.pages.pop(struct.unpack("<iii", payload[:12]), None)
        elif name == "statistics":  # a member that is missing stays as it was
            self.last.setdefault(name, {}).update(json.loads(payload))
        elif name in ("path", "scan"):
            self.kinds.add((name, payload[0]))
        elif name in ("hello", "telemetry", "event"):
            self.last[name] = json.loads(payload)
            if name == "event":
                self.events.append(self.last[name])
        return name

    def watch(self, done, limit_s=60):
        """Reads until a condition holds; whether it did."""
        end = time.monotonic() + limit_s
        while not done(self):
            if time.monotonic() > end or self.read() is None:
                return done(self)
        return True

    def triangles(self):
        return sum(count for _, level, count in self.pages.values() if level == 0)
