"""hm scan: a replay, OpenNI without hardware; stopped, killed and continued; wrong use. scan_saved_test.py: unplugged."""
import json
import os
import resource
import shutil
import signal
import subprocess
import time

import support
from scans import QUICK, ScanTest


class Scan(ScanTest):
    def test_replay_gives_a_result_and_the_same_recording(self):
        run = self.replay("-o", "result", "--speed", "0.5")
        self.check_capture(run["capture"])
        self.assertNotIn("registered", " ".join(run["warnings"]))
        self.assertEqual(run["capture"]["captured"], 60)
        self.assertEqual(run["capture"]["recorded"], 60)
        self.assertGreater(run["capture"]["tracked"], 20)
        self.assertEqual(run["frames"]["lost"], run["capture"]["lost"])
        self.check_results("result", ["trajectory.tum", "mesh.ply", "map.hmap", "report.json", "report.html"],
                           ("What became of the frames of the camera",))
        report = json.loads((self.folder / "result/report.json").read_text())
        self.assertEqual(report["capture"]["captured"], 60)
        recorded = self.run_json("info", "result/recording")
        self.assertEqual(recorded["frames"], 60)
        self.assertEqual(self.stamps("result/recording"),
                         [line.split()[0] for line in (self.recording / "depth.txt").read_text().splitlines()
                          if not line.startswith("#")])
        first = next(iter(sorted((self.recording / "depth").iterdir())))
        self.assertEqual(self.run_json("slam", "result/recording", "-o", "again", *QUICK)["frames"]["tracked"], 60)
        self.assertTrue((self.folder / "result/recording/depth" / first.name).exists())

    def test_stopped(self):
        process = self.start_replay("result", "--speed", "0.2")
        self.wait_for_frames("result/recording", 5, process)
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=120)
        self.assertEqual(process.returncode, 0, errors)
        run = json.loads(output)
        self.check_capture(run["capture"])
        self.assertFalse(run["interrupted"], "a scan has no other end")
        self.assertEqual(run["capture"]["ended_because"], "stopped")
        self.assertLess(run["capture"]["captured"], 60)
        self.assertEqual(json.loads((self.folder / "result/run.json").read_text())["state"], "complete")

    def test_killed(self):
        process = self.start_replay("result", "--speed", "0.2", "--set", "reconstruction.save_interval_s=0.3")
        self.wait_for_frames("result/recording", 5, process)
        process.kill()
        process.communicate()
        frames = len(self.stamps("result/recording"))
        self.assertGreater(frames, 0)
        self.assertTrue(self.run_json("info", "result/map.hmap")["ok"])
        # What a kill may cut: the end of a list.
        with (self.folder / "result/recording/depth.txt").open("a") as file:
            file.write("99.0 dep")
        self.replay("-o", "result", expect=2)  # never over a recording without being asked to
        run = self.replay("-o", "result", "--resume", "--speed", "4")
        self.assertEqual(run["capture"]["earlier_frames"], frames)
        self.assertEqual(len(self.stamps("result/recording")), frames + run["capture"]["recorded"])
        self.assertEqual(self.stamps("result/recording"), sorted(set(self.stamps("result/recording")), key=float))

    def test_the_recording_is_not_replayed_into_itself(self):
        self.replay("-o", "result", "--seconds", "0.3")
        stamps = self.stamps("result/recording")
        for word in "--overwrite", "--resume":
            error = self.run_json("scan", "--camera", "replay:result/recording", "-o", "result", word, *QUICK, expect=2)
            self.assertIn("another folder", error["error"]["message"])
        self.assertEqual(self.stamps("result/recording"), stamps)

    def test_no_usable_frame(self):
        """Images without colour: not one frame, and the error says why."""
        shutil.copytree(self.recording, self.folder / "grey", ignore=shutil.ignore_patterns("rgb*", "associations.txt"))
        error = self.run_json("scan", "--camera", "replay:grey", "-o", "result", "--speed", "4", *QUICK, expect=3)["error"]
        self.assertIn("not one of 60 images could be used: no_color 60", error["message"])

    def test_a_map_that_cannot_be_saved_ends_the_scan(self):
        """As on a full disk, while the camera runs on: an error, and what was recorded stays."""
        def limit_files():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000))
        result = subprocess.run(
            [support.PROGRAM, "scan", "--camera", f"replay:{self.recording}", "-o", "result", "--json", *QUICK[2:], "--speed", "0.2",
             "--voxel", "0.02", "--set", "reconstruction.save_interval_s=0.2"], cwd=self.folder, capture_output=True,
            text=True, timeout=300, preexec_fn=limit_files)
        self.assertEqual(result.returncode, 1, result.stderr[-2000:])
        # Which file grows too large first depends on how many frames were taken until then.
        self.assertRegex(result.stderr, r"(map\.hmap|mesh\.ply): ")
        self.assertEqual(self.run_json("info", "result/recording")["frames"], len(self.stamps("result/recording")))
        if (self.folder / "result/map.hmap").exists():
            self.assertTrue(self.run_json("info", "result/map.hmap")["ok"])

    def test_a_recording_with_a_gap_has_results(self):
        process = self.start_replay("result", "--speed", "0.5")
        self.wait_for_frames("result/recording", 5, process)
        images = self.folder / "result/recording/depth"
        images.rename(self.folder / "away")  # as a disk that is away for a moment
        time.sleep(0.5)
        (self.folder / "away").rename(images)
        output, errors = process.communicate(timeout=120)
        self.assertEqual(process.returncode, 1, errors)
        run = json.loads(output)
        self.check_capture(run["capture"])
        self.assertGreater(run["capture"]["not_recorded"], 0)
        self.assertIn("cannot be written", run["error"]["message"])
        self.assertTrue(any("not in the recording" in warning for warning in run["warnings"]), run["warnings"])
        self.assertTrue((self.folder / "result/mesh.ply").exists())
        self.assertTrue((self.folder / "result/report.html").exists())

    def test_another_camera_cannot_continue(self):
        self.replay("-o", "result", "--seconds", "0.3")
        camera = ["--intrinsics", "500", "500", "319.5", "239.5"]
        error = self.replay("-o", "result", "--resume", *camera, expect=2)["error"]
        self.assertIn("of another camera", error["message"])
        self.assertEqual(self.replay("-o", "result", "--overwrite", "--seconds", "0.3", *camera)["capture"]["lost"], 0)

    def test_wrong_use(self):
        self.assertIn("--list", self.run_json("scan", expect=2)["error"]["message"])
        self.assertIn("replay:RECORDING", self.run_json("scan", "--camera", "webcam", expect=2)["error"]["message"])
        self.run_json("scan", "--camera", "replay:nowhere", "-o", "result", expect=3)
        self.assertFalse((self.folder / "result").exists())
        cameras = {camera["driver"]: camera for camera in self.run_json("scan", "--list")["cameras"]}
        self.assertEqual(set(cameras), {"openni", "freenect", "v4l2"})
        for name, camera in cameras.items():
            if camera["devices"] and camera["built"]:
                continue  # there is one on this computer
            if not camera["built"]:
                self.assertIn("install lib", camera["state"])
            expect = 3 if camera["built"] else 2
            words = ["--intrinsics", "525", "525", "319.5", "239.5"] if name == "v4l2" else []
            self.run_json("scan", "--camera", name, "-o", "result", *words, expect=expect)

    def test_openni(self):
        listed = self.run_with(self.openni(), "--list")["cameras"]
        self.assertEqual([c["devices"] for c in listed if c["driver"] == "openni"], [["replay"]])
        run = self.run_with(self.openni(), "--camera", "openni", "-o", "result", "--seconds", "1.2")
        capture = run["capture"]
        self.check_capture(capture)
        self.assertIn("replay of a recording", capture["camera"])
        self.assertGreater(capture["tracked"], 5)
        info = self.run_json("info", "result/recording")
        self.assertEqual(info["frames"], capture["recorded"])
        camera = (self.folder / "result/recording/camera.txt").read_text()
        self.assertRegex(camera, r"fx 525\n")
        self.assertIn("depth_scale 1000", camera)

    def test_openni_continues_with_new_images(self):
        """The camera is read from its start, after all of the recording was tracked again."""
        self.run_with(self.openni(HM_OPENNI_FRAMES="30"), "--camera", "openni", "-o", "result", expect=1)
        frames = len(self.stamps("result/recording"))
        run = self.run_with(self.openni(HM_OPENNI_FRAMES="30"), "--camera", "openni", "-o", "result", "--resume", expect=1)
        self.check_capture(run["capture"])
        self.assertEqual(run["capture"]["earlier_frames"], frames)
        self.assertGreater(run["capture"]["captured"], 5)

    def test_openni_dummy_device(self):
        """OpenNI's own device without hardware: pictures of nothing, and no field of view."""
        if not os.environ.get("HM_OPENNI"):
            self.skipTest("built without OpenNI")
        words = ["--camera", "openni:Dummy", "-o", "result", "--seconds", "1"]
        self.assertIn("--intrinsics", self.run_with({}, *words, expect=2)["error"]["message"])
        run = self.run_with({}, *words, "--intrinsics", "280", "280", "159.5", "119.5", "--size", "320", "240",
                            expect=3)
        self.assertIn("not one of", run["error"]["message"])
        self.assertGreater(len(self.stamps("result/recording")), 3)

    def test_openni_closes_while_its_thread_runs(self):
        """The dummy device's thread touches its streams once more after they were stopped: one scan of five crashed."""
        if not os.environ.get("HM_OPENNI"):
            self.skipTest("built without OpenNI")
        scans = [subprocess.Popen([support.PROGRAM, "scan", "--camera", "openni:Dummy", "-o", f"result_{i}", "--seconds", "0.5",
                                   "--intrinsics", "280", "280", "159.5", "119.5", "--size", "320", "240"], cwd=self.folder,
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for i in range(8)]
        self.assertEqual([scan.wait(timeout=120) for scan in scans], [3] * 8)


if __name__ == "__main__":
    support.main()
