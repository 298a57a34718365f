"""The live view of the built program: results, replays and runs, as a client of its server sees them."""
import json
import re
import signal
import socket
import sys
import unittest
import urllib.error
import urllib.request

from live_viewer import Viewer
from support import ProgramTest

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
        self.simulate(frames=80)
        process, port = self.open("reconstruct", "recording", "-o", "result", "--serve=0", "--voxel", "0.05")
        viewer = self.view(port)
        self.assertTrue(viewer.watch(lambda v: v.last.get("telemetry", {}).get("state") == "finished"))
        self.assertEqual(viewer.last["hello"]["source"]["verb"], "reconstruct")
        self.assertEqual(viewer.last["telemetry"]["verdict"]["verdict"], "ok")
        self.assertEqual(viewer.last["statistics"]["counts"]["frames integrated"], 80)
        self.assertGreater(viewer.counts["pose"], 2)
        self.assertEqual(process.wait(timeout=60), 0)
        live = viewer.triangles()
        self.assertGreater(live, 1000)

        _, port = self.open("serve", "result", "--listen", "0")
        viewer = self.view(port)
        self.assertTrue(viewer.watch(lambda v: v.last.get("telemetry", {}).get("state") == "finished" and v.triangles() >= live))
        self.assertEqual(viewer.triangles(), live)
        self.assertGreater(viewer.counts["path"], 0)
        self.assertEqual(viewer.last["telemetry"]["verdict"]["verdict"], "ok")
        self.assertGreater(viewer.last["telemetry"]["coverage"]["share"], 0.05)
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
        self.simulate("flight", 200, "room", "--sensor", "laser_mav")
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
