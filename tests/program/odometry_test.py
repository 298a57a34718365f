"""hm odometry: a simulated room end to end, broken pictures, Ctrl-C, wrong input, real recordings where they are."""
import json
import shutil
import signal
import struct
import time
import zlib

import support

KEYS = {"frames", "track_ms", "path_length_m", "keyframes", "loops", "model_points", "lost_stretches"}
TRUTH_KEYS = {"ate_rmse_m", "rpe_frame_m", "rpe_second_m", "rpe_second_rad"}
PLAIN = ("--set", "reconstruction.pictures=false", "--set", "mesh_error.samples=20000")
SLAM = ("--voxel", "0.06", "--set", "slam.matrices=false", *PLAIN)
FILES = ["trajectory.tum", "parameters.toml", "report.json", "report.html"]
# Recording -> (frames, largest ATE in metres, options).
REAL = {"tum_fr1_xyz": (101, 0.03, []), "icl_of_kt3": (30, 0.02, []),
        "sevenscenes_a": (60, 0.05, ["--set", "reconstruction.frame_limit=60"])}


def black_png(width, height, bits, channels):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    row = bytes(1 + width * channels * bits // 8)  # a filter of 0, and nothing but zeros
    head = struct.pack(">IIBBBBB", width, height, bits, 2 if channels == 3 else 0, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(row * height)) +
            chunk(b"IEND", b""))


class Odometry(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        keeper.simulate("room", 60, "room", "--sensor", "kinect")
        Odometry.recording = keeper.folder / "room"

    def check_files(self, result):
        self.check_results(result, FILES, ("<svg", "From above", "From the side", "Model and data", "Duration of each frame"))

    def test_room_end_to_end(self):
        run = self.run_json("odometry", self.recording, "-o", "result")
        self.assertLessEqual(KEYS | TRUTH_KEYS, set(run))
        self.assertEqual(run["frames"], {"total": 60, "read": 60, "tracked": 60, "by_depth": 0, "lost": 0, "unused": 0})
        self.assertLess(run["ate_rmse_m"], 0.02)
        self.assertLess(abs(run["path_length_m"] - run["truth_path_m"]), 0.15 * run["truth_path_m"] + 0.05)
        self.assertGreater(run["keyframes"], 0)
        self.assertGreater(run["model_points"], 50)
        self.assertGreaterEqual(run["track_ms"]["p99"], run["track_ms"]["median"])
        self.check_files("result")
        lines = (self.folder / "result/trajectory.tum").read_text().splitlines()
        self.assertEqual(len(lines), 60)
        again = self.run_json("evaluate", "trajectory", "result/trajectory.tum", self.recording)
        self.assertAlmostEqual(again["ate_rmse_m"], run["ate_rmse_m"], places=6)
        self.assertAlmostEqual(again["rpe_second_m"], run["rpe_second_m"], places=6)
        # Its poses are what a reconstruction can be made of, and the same again.
        mesh = self.run_json("reconstruct", self.recording, "-o", "mesh", "--poses", "result/trajectory.tum", "--voxel",
                             "0.05", *PLAIN)
        self.assertEqual(mesh["frames"]["integrated"], 60)
        self.run_hm("odometry", self.recording, "-o", "twice", "--quiet")
        self.assertEqual((self.folder / "twice/trajectory.tum").read_text().splitlines(), lines)

    def test_published_methods(self):
        for method in ("published_icp", "published_ransac_icp", "frame_to_frame"):
            with self.subTest(method):
                run = self.run_json("odometry", self.recording, "-o", method, "--method", method, "--set",
                                    "reconstruction.frame_limit=40")
                self.assertEqual(run["method"], method)
                self.assertGreater(run["frames"]["tracked"], 30)
        self.run_hm("odometry", self.recording, "--method", "guessing", expect=2)

    def test_unreadable_and_black_frames_are_named(self):
        folder = self.folder / "broken"
        shutil.copytree(self.recording, folder)
        depth = sorted((folder / "depth").iterdir())
        depth[20].write_bytes(b"this is no picture")
        depth[30].unlink()
        run = self.run_json("odometry", "broken", "-o", "result")
        self.assertEqual([frame["index"] for frame in run["unused_frames"]], [20, 30])
        self.assertEqual(run["frames"]["read"], 58)
        self.assertEqual(run["frames"]["tracked"] + run["frames"]["lost"], 58)
        self.assertGreater(run["frames"]["tracked"], 50)
        self.assertTrue(any("could not be used" in warning for warning in run["warnings"]))
        self.assertIn("Unused frames", (self.folder / "result/report.html").read_text())

    def test_found_again_after_thirty_black_frames(self):
        folder = self.folder / "blackout"
        folder.mkdir()
        for name in ("rgb", "depth"):
            (folder / name).symlink_to(self.recording / name)
        shutil.copy(self.recording / "camera.txt", folder)
        (folder / "black.png").write_bytes(black_png(640, 480, bits=8, channels=3))
        (folder / "none.png").write_bytes(black_png(640, 480, bits=16, channels=1))
        frames = [line.split() for line in (self.recording / "associations.txt").read_text().splitlines()
                  if not line.startswith("#")]
        frames[25:25] = [[None, "black.png", None, "none.png"]] * 30
        for column, name in ((1, "rgb"), (3, "depth")):
            (folder / f"{name}.txt").write_text(
                "".join(f"{1 + i / 30:.6f} {frame[column]}\n" for i, frame in enumerate(frames)))
        run = self.run_json("odometry", "blackout", "-o", "result")
        self.assertEqual(run["frames"], {"total": 90, "read": 90, "tracked": 60, "by_depth": 0, "lost": 30,
                                         "unused": 0})
        self.assertEqual(len(run["lost_stretches"]), 1, run["lost_stretches"])
        # As if it had not been dark: what was tracked is where the truth of these frames is.
        tracked = (self.folder / "result/trajectory.tum").read_text().splitlines()
        stamps = [frame[0] for frame in frames if frame[0]]
        poses = [line.split() for line in tracked if not line.startswith("#")]
        self.assertEqual(len(poses), 60)
        (self.folder / "undimmed.tum").write_text(
            "".join(" ".join([stamp, *pose[1:]]) + "\n" for stamp, pose in zip(stamps, poses)))
        error = self.run_json("evaluate", "trajectory", "undimmed.tum", self.recording)
        self.assertLess(error["ate_rmse_m"], 0.02)

    def test_interrupt_finishes_with_what_there_is(self):
        process = self.start("odometry", self.recording, "-o", "stopped", "--json", "--method", "published_icp")
        self.addCleanup(process.kill)
        deadline = time.monotonic() + 60
        while not (self.folder / "stopped").is_dir() and time.monotonic() < deadline:
            time.sleep(0.02)
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=60)
        document = json.loads(output)
        if process.returncode == 1:  # stopped before the first pose
            self.assertIn("stopped before", document["error"]["message"])
            return
        self.assertEqual(process.returncode, 0, errors)
        if document["interrupted"]:  # else it was faster
            self.assertLess(document["frames"]["read"], document["frames"]["total"])
            self.assertTrue(any("stopped after" in warning for warning in document["warnings"]))
        self.check_files("stopped")

    def test_wrong_input(self):
        self.run_json("odometry", "nowhere", expect=3)
        (self.folder / "empty").mkdir()
        self.run_json("odometry", "empty", expect=3)
        (self.folder / "file").write_text("")
        self.run_json("odometry", self.recording, "-o", "file/result", expect=2)
        self.run_json("odometry", self.recording, "--set", "odometry.methd=tracker", expect=2)
        document = self.run_json("odometry", self.recording, "-o", "late", "--set",
                                 "reconstruction.begin_frame=1000", expect=3)
        self.assertIn("range of frames is empty", document["error"]["message"])

    def without_color(self, name, is_kept, recording=None):
        """A copy of a recording that has only the colour images of the frames `is_kept(index)`."""
        recording = recording or self.recording
        folder = self.folder / name
        folder.mkdir()
        for part in ("rgb", "depth"):
            (folder / part).symlink_to(recording / part)
        for part in ("camera.txt", "depth.txt", "groundtruth.txt"):
            shutil.copy(recording / part, folder)
        pictures = [line for line in (recording / "rgb.txt").read_text().splitlines() if not line.startswith("#")]
        kept = [line for index, line in enumerate(pictures) if is_kept(index)]
        if kept:
            (folder / "rgb.txt").write_text("\n".join(kept) + "\n")
        return folder

    def test_readings_of_an_imu_are_used_where_there_are_any(self):
        phone = self.simulate("phone", 40, "house", "--sensor", "tango_phone")  # 8 s; readings prove right for two
        for verb, more in (("odometry", ()), ("slam", SLAM)):
            run = self.run_json(verb, phone, "-o", verb, *more)
            self.assertEqual(run["frames"]["tracked"], 40)
            self.assertGreaterEqual(run["imu"]["inertial_used"], 20)
        without = self.run_json("odometry", phone, "-o", "without", "--set", "odometry.use_imu=off")
        self.assertEqual(without.get("imu", {}).get("inertial_used", 0), 0)

    def test_colour_that_is_missing_is_no_loss(self):
        gap = self.without_color("gap", lambda index: not 20 <= index < 45)
        for verb, more in (("odometry", ()), ("slam", SLAM)):
            run = self.run_json(verb, gap, "-o", verb, *more)
            frames = run["frames"]
            # When colour returns one frame may be lost before landmarks begin anew.
            self.assertGreaterEqual(frames["tracked"], 59)
            self.assertEqual(frames["unused"], 0)
            self.assertGreaterEqual(frames["by_depth"], 25)
            self.assertEqual(run["submaps"], 1)
            self.assertLess(run["ate_rmse_m"], 0.03)
            self.assertTrue(any("by depth alone" in warning for warning in run["warnings"]), run["warnings"])
            self.assertIn("by depth alone", (self.folder / verb / "report.html").read_text())
        status = json.loads((self.folder / "odometry/report.json").read_text())["series"]["status"]
        self.assertGreaterEqual(status.count("tracked by depth"), 25)

    def test_depth_images_alone(self):
        house = self.simulate("rooms", 60, "house", "--sensor", "kinect")
        run = self.run_json("odometry", self.without_color("alone", lambda index: False, house), "-o", "result")
        self.assertEqual((run["frames"]["by_depth"], run["frames"]["lost"]), (60, 0))
        self.assertLess(run["ate_rmse_m"], 0.005)
        self.assertEqual(run["verdict"]["value"], "ok")
        self.check_files("result")

    def test_a_wall_alone_does_not_show_the_place(self):
        # The room's walk begins before a wall, which leaves the motion along it free, and no image shows that.
        run = self.run_json("odometry", self.without_color("wall", lambda index: False), "-o", "wall_result")
        self.assertGreater(run["frames"]["by_depth_sigma_m"], 0.1)
        self.assertNotEqual(run["verdict"]["value"], "ok")
        self.assertTrue(any("surfaces alone" in reason for reason in run["verdict"]["reasons"]), run["verdict"])

    def test_real_recordings(self):
        data = support.real_data()
        if not data:
            self.skipTest("no real recordings in $HM_DATA or ../shared/data")
        for name, (frames, ate_m, options) in REAL.items():
            with self.subTest(name):
                run = self.run_json("odometry", data / "rgbd" / name, "-o", name, *options)
                self.assertEqual(run["frames"]["total"], frames)
                self.assertEqual(run["frames"]["tracked"], frames)
                self.assertLess(run["ate_rmse_m"], ate_m)
                self.check_files(name)


if __name__ == "__main__":
    support.main()
