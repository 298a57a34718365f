"""The live view of the built program: results, replays and runs, as a client of its server sees them."""
import json
import os
import pty
import re
import signal
import socket
import subprocess
import sys
import time
import unittest
import urllib.error
import urllib.request

from live_viewer import Viewer
from support import PROGRAM, ProgramTest

PLAIN = ["--set", "reconstruction.pictures=false", "--set", "mesh_error.samples=20000"]


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
        process, port = self.open("reconstruct", "recording", "-o", "result", "--serve=0", "--voxel", "0.02", *PLAIN)
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
        self.assertGreater(status["memory"]["process"], 1e6)
        self.assertLess(status["memory"]["heap"], status["memory"]["process"])
        (self.folder / "exported.ply").write_bytes(self.get(port, "/api/mesh.ply"))
        self.assertGreater(self.run_json("info", "exported.ply")["triangles"], 1000)
        self.assertTrue(self.get(port, "/api/mesh.glb").startswith(b"glTF"))
        self.assertIn(b"<svg", self.get(port, "/api/plan.svg"))
        self.assertIn(b"<html", self.get(port, "/api/report").lower())
        with self.assertRaises(urllib.error.HTTPError) as missing:
            self.get(port, "/api/../../etc/passwd")
        self.assertEqual(missing.exception.code, 404)

    def test_what_is_known_of_results_and_replays_is_told(self):
        self.simulate(frames=30)
        self.run_hm("reconstruct", "recording", "-o", "result", "--voxel", "0.05", *PLAIN)
        _, port = self.open("serve", "result", "--listen", "0")
        told = json.loads(self.get(port, "/api/statistics"))
        self.assertIn("voxel_size_m = 0.05", told["parameters"])
        self.assertEqual(told["counts"]["frames.integrated"], 30)
        self.assertGreater(told["stages"]["integrate"], 0)
        self.assertGreater(told["rates"]["frames"], 0)
        self.assertGreater(told["memory"]["map"], 1000)
        self.assertGreater(told["memory"]["process"], 1e6)

        _, port = self.open("serve", "result/map.hmap", "--listen", "0")
        told = json.loads(self.get(port, "/api/statistics"))
        self.assertIn("voxel_size_m = 0.05", told["parameters"])
        self.assertGreater(told["memory"]["process"], 1e6)

        _, port = self.open("serve", "recording", "--listen", "0", "--voxel", "0.06")
        viewer = self.view(port)
        viewer.send({"type": "replay", "speed": 100})
        self.assertTrue(viewer.watch(lambda v: v.last.get("statistics", {}).get("counts", {}).get("frames integrated") == 30))
        told = json.loads(self.get(port, "/api/statistics"))
        self.assertIn("voxel_size_m = 0.06", told["parameters"])
        self.assertGreater(told["stages"]["integrate"], 0)
        self.assertGreater(told["memory"]["map"], 1000)

    def test_every_run_sends_its_parameters(self):
        self.simulate(frames=60)
        self.simulate("flight", 200, "room", "--sensor", "laser_mav")
        for words, section in (
                (["reconstruct", "recording", "--set", "tsdf.far_m=3.5"], "far_m = 3.5"),
                (["slam", "recording", "--set", "tsdf.far_m=3.5"], "far_m = 3.5"),
                (["odometry", "recording", "--method", "published_ransac_icp"], "method = 'published_ransac_icp'"),
                (["laser", "flight", "--set", "mvog.resolution_m=0.07"], "resolution_m = 0.07"),
                (["scan", "--camera", "replay:recording", "--set", "tsdf.far_m=3.5"], "far_m = 3.5"),
                (["fly", "hover", "--set", "mvog.resolution_m=0.07"], "resolution_m = 0.07"),
                (["demo", "--set", "simulation.frame_limit=30"], "frame_limit = 30")):
            process, port = self.open(*words, "-o", f"result_{words[0]}", "--serve=0")
            viewer = self.view(port)
            self.assertTrue(viewer.watch(lambda v: "parameters" in v.last.get("statistics", {})), words)
            self.assertIn(section, viewer.last["statistics"]["parameters"], words)
            viewer.close()
            self.end(process)

    def test_an_unplugged_scan_says_why(self):
        self.simulate("room", 60, "room", "--sensor", "kinect")
        process, port = self.open("scan", "--camera", "replay:room", "-o", "result", "--unplug-after", "1.2", "--voxel", "0.06", "--serve=0")
        viewer = self.view(port)
        self.assertTrue(viewer.watch(lambda v: v.last.get("telemetry", {}).get("state") == "failed"))
        self.assertIn("unplugged after 1.2 s", viewer.last["telemetry"]["reason"])
        self.assertTrue(viewer.watch(lambda v: any(event["level"] == "error" for event in v.events)))
        self.assertIn("failed: ", viewer.events[-1]["text"])
        self.assertEqual(process.wait(timeout=60), 1)

    def test_a_flight_tells_its_numbers_its_way_and_the_truth(self):
        (self.folder / "tour.txt").write_text("0.8 0 1.2\n0.8 0.5 1.2\n")
        process, port = self.open("fly", "waypoints", "tour.txt", "-o", "toured", "--serve=0")
        viewer = self.view(port)
        self.assertTrue(viewer.watch(lambda v: {("path", 0), ("path", 2), ("path", 3), ("scan", 0)} <= v.kinds), viewer.kinds)
        self.assertTrue(viewer.watch(lambda v: v.last.get("statistics", {}).get("rates", {}).get("perception", 0) > 0))
        told = viewer.last["statistics"]
        self.assertGreater(told["stages"]["match"], 0)
        self.assertIn("serial up dropped", told["counts"])
        self.assertGreater(told["memory"]["map"], 0)
        self.end(process)

    def test_on_a_terminal_the_link_is_shown_once_and_the_report_offered(self):
        self.simulate(frames=10)
        ours, of_the_run = pty.openpty()
        process = subprocess.Popen([PROGRAM, "reconstruct", "recording", "-o", "result", "--voxel", "0.06", "--serve=0", *PLAIN], cwd=self.folder,
                                   stdout=subprocess.PIPE, stderr=of_the_run)
        os.close(of_the_run)
        said, end = "", time.monotonic() + 60
        while "stays open until Ctrl-C" not in said and time.monotonic() < end:
            said += os.read(ours, 4096).decode()
        links = re.findall(r"http://127\.0\.0\.1:(\d+)/", said)
        self.assertEqual(len(links), 1, said)
        self.assertIn(b"<html", self.get(links[0], "/api/report").lower())
        with self.assertRaises(urllib.error.HTTPError) as foreign:
            urllib.request.urlopen(urllib.request.Request(f"http://127.0.0.1:{links[0]}/api/status", headers={"Origin": "http://evil.com"}), timeout=20)
        self.assertEqual(foreign.exception.code, 403)
        self.assertEqual(json.loads(self.get(links[0], "/api/status"))["refused"]["origin"], 1)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
        os.close(ours)
        self.assertEqual(process.returncode, 0)

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
