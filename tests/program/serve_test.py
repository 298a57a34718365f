"""The live view of the built program: results, replays and runs, as a client of its server sees them."""
import json
import re
import signal
import socket
import struct
import sys
import time
import unittest
import urllib.error
import urllib.request
from base64 import b64encode
from os import urandom

from support import ProgramTest

KINDS = {1: "hello", 2: "page", 3: "gone", 4: "pose", 5: "path", 8: "tile", 9: "telemetry", 10: "event", 11: "picture", 12: "statistics"}


class Viewer:
    """A viewer of /live."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=20)
        key = b64encode(urandom(16)).decode()
        self.socket.sendall((f"GET /live HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                             f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n").encode())
        self.bytes = b""
        while b"\r\n\r\n" not in self.bytes:
            self.bytes += self.socket.recv(4096)
        self.bytes = self.bytes.split(b"\r\n\r\n", 1)[1]
        self.pages, self.last, self.counts, self.acked = {}, {}, {}, 0.0
        self.send({"type": "hello", "protocol": 1, "session": "", "pages": [], "more": False})

    def close(self):
        self.socket.close()

    def send(self, message):
        self.frame(1, json.dumps(message).encode())

    def frame(self, code, content):
        mask = urandom(4)
        length = bytes([0x80 | len(content)]) if len(content) < 126 else b"\xfe" + struct.pack(">H", len(content))
        self.socket.sendall(bytes([0x80 | code]) + length + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(content)))

    def take(self, count):
        while len(self.bytes) < count:
            more = self.socket.recv(1 << 16)
            if not more:
                raise EOFError
            self.bytes += more
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
        if time.monotonic() - self.acked > 0.02:
            self.acked = time.monotonic()
            self.send({"type": "ack", "sequence": sequence})
        return self.note(KINDS.get(kind, "other"), content[16:])

    def note(self, name, payload):
        self.counts[name] = self.counts.get(name, 0) + 1
        if name == "page":
            x, y, z, page_version = struct.unpack("<iiiI", payload[:16])
            self.pages[x, y, z] = (page_version, payload[16], struct.unpack("<I", payload[24:28])[0] // 3)
        elif name == "gone":
            self.pages.pop(struct.unpack("<iii", payload[:12]), None)
        elif name in ("hello", "telemetry", "statistics", "event"):
            self.last[name] = json.loads(payload)
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


class ServeTest(ProgramTest):
    def view(self, port):
        viewer = Viewer(port)
        self.addCleanup(viewer.close)
        return viewer

    def open(self, *words):
        """Starts a program that serves; its port."""
        process = self.start(*words)
        self.addCleanup(self.end, process)
        self.said = ""
        for line in process.stderr:
            self.said += line
            if found := re.search(r"http://127\.0\.0\.1:(\d+)/", line):
                return process, int(found.group(1))
        self.fail(f"no address: {self.said}")

    @staticmethod
    def end(process):
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=60)
        process.stdout.close()
        process.stderr.close()

    @staticmethod
    def get(port, path):
        with urllib.request.urlopen(f"http://127.0.0.1:{port}{path}", timeout=60) as answer:
            return answer.read()

    def test_a_run_is_watched_and_its_result_served(self):
        self.simulate(frames=20)
        process, port = self.open("reconstruct", "recording", "-o", "result", "--serve=0", "--voxel", "0.05")
        viewer = self.view(port)
        self.assertTrue(viewer.watch(lambda v: v.last.get("telemetry", {}).get("state") == "finished"))
        self.assertEqual(viewer.last["hello"]["source"]["verb"], "reconstruct")
        self.assertEqual(viewer.last["telemetry"]["verdict"]["verdict"], "ok")
        self.assertEqual(viewer.last["statistics"]["counts"]["frames integrated"], 20)
        self.assertGreater(viewer.counts["pose"], 2)
        self.assertEqual(process.wait(timeout=60), 0)
        live = viewer.triangles()
        self.assertGreater(live, 1000)

        _, port = self.open("serve", "result", "--listen", "0")
        viewer = self.view(port)
        self.assertTrue(viewer.watch(lambda v: v.last.get("telemetry", {}).get("state") == "finished" and v.triangles() >= live))
        self.assertEqual(viewer.triangles(), live)
        self.assertGreater(viewer.counts["path"], 0)
        status = json.loads(self.get(port, "/api/status"))
        self.assertIn("telemetry", status)
        (self.folder / "exported.ply").write_bytes(self.get(port, "/api/mesh.ply"))
        self.assertGreater(self.run_json("info", "exported.ply")["triangles"], 1000)
        self.assertTrue(self.get(port, "/api/mesh.glb").startswith(b"glTF"))
        self.assertIn(b"<svg", self.get(port, "/api/plan.svg"))
        self.assertIn(b"<html", self.get(port, "/api/report").lower())
        with self.assertRaises(urllib.error.HTTPError) as missing:
            self.get(port, "/api/../../etc/passwd")
        self.assertEqual(missing.exception.code, 404)

    def test_a_recording_is_replayed_paused_and_rewound(self):
        self.simulate(frames=30)
        process, port = self.open("serve", "recording", "--listen", "0", "--voxel", "0.05")
        viewer = self.view(port)

        def replay(v):
            return v.last.get("telemetry", {}).get("replay", {})

        viewer.send({"type": "replay", "speed": 100})
        self.assertTrue(viewer.watch(lambda v: v.last.get("telemetry", {}).get("state") == "finished"))
        whole = replay(viewer)["end_s"]
        self.assertAlmostEqual(replay(viewer)["time_s"], whole, places=2)
        pages = len(viewer.pages)
        viewer.send({"type": "replay", "paused": True, "seek_s": whole / 10})
        self.assertTrue(viewer.watch(lambda v: replay(v)["time_s"] < whole / 5 and replay(v)["paused"]))
        self.assertTrue(viewer.watch(lambda v: len(v.pages) < pages, 20), "pages of later frames are gone")
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(timeout=20), 0)

    def test_a_laser_recording_is_replayed(self):
        self.run_hm("simulate", "room", "-o", "flight", "--sensor", "laser_mav", "--frames", "200", "--quiet")
        _, port = self.open("serve", "flight", "--listen", "0")
        viewer = self.view(port)
        viewer.send({"type": "replay", "speed": 100})
        self.assertTrue(viewer.watch(lambda v: v.last.get("telemetry", {}).get("state") == "finished"))
        self.assertGreater(viewer.counts.get("tile", 0), 0)
        self.assertIn("vehicle", viewer.last["telemetry"])

    def test_what_cannot_be_served_is_an_error(self):
        self.run_hm("serve", "nothing_here", expect=3)
        (self.folder / "broken.hmap").write_bytes(b"SQLite format 3\0 and nothing")
        self.assertIn("broken.hmap", self.run_hm("serve", "broken.hmap", "--listen", "0", expect=3).stderr)
        self.simulate(frames=4)
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            said = self.run_hm("serve", "recording", "--listen", port, expect=1).stderr
            self.assertIn(str(port), said)
        self.assertIn("ADDRESS", self.run_hm("serve", "recording", "--listen", "127.0.0.1:x", expect=2).stderr)


if __name__ == "__main__":
    sys.exit(unittest.main())
