"""hm laser: a simulated flight end to end, every real laser recording where it is there, Ctrl-C, wrong input."""
import json
import math
import shutil
import time
from pathlib import Path

import support

KEYS = {"scans", "match_ms", "path_length_m", "path_length_odom_m", "mvog", "insert_us_per_beam", "choices", "bounds_m",
        "loops", "localisation"}
LOOP_KEYS = {"corrected", "T_map_odom", "max_shift_m", "rebuild_s", "nodes", "candidates", "accepted", "rejected"}
INTEL = "laser/flirt_intel-lab.log"
FILES = ["trajectory.tum", "map.mvog", "map.bt", "map.ply", "map.yaml", "map.pgm", "parameters.toml", "report.json",
         "report.html"]
# Recording -> (poses from, least share of scans with a pose, path between, area of the map between, m and m2).
REAL = {
    "bags/scan_tools_laser_demo.bag": ("scans", 1.0, (4, 9), (10, 40)),
    "laser/wean_robotdata1.log": ("scans", 0.98, (30, 60), (80, 400)),
    "laser/breezyslam_exp1.dat": ("scans", 0.98, (30, 70), (80, 500)),
    "laser/ncd_QuadTree_Alog.alog": ("odometry", 0.99, (2, 6), (50, 160)),
}


class Laser(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        Laser.flight = keeper.simulate("flight", 480, "room", "--sensor", "laser_mav")

    def check_files(self, result, names):
        self.check_results(result, names, ("<svg",))

    def test_flight_end_to_end(self):
        run = self.run_json("laser", self.flight, "-o", "result")
        self.assertLessEqual(KEYS | {"ate_rmse_m", "height_rmse_m", "floors"}, set(run))
        self.assertLessEqual(LOOP_KEYS, set(run["loops"]))
        self.assertIsNone(run["localisation"])
        scans = run["scans"]
        self.assertEqual(scans["read"], scans["total"])
        self.assertEqual(scans["read"], scans["posed"] + scans["failed"])
        self.assertGreater(scans["posed"], 0.95 * scans["read"])
        self.assertGreater(scans["keyframes"], 0)
        self.assertLess(run["ate_rmse_m"], 0.08)
        self.assertLess(run["height_rmse_m"], 0.03)
        self.assertGreater(run["mvog"]["volumes_positive"], 100)
        self.assertGreater(run["mvog"]["volumes_negative"], 100)
        self.assertGreaterEqual(run["match_ms"]["p99"], run["match_ms"]["median"])
        self.check_files("result", FILES + ["height.csv", "floors.csv", "states.csv"])
        page = (self.folder / "result/report.html").read_text()
        for word in ("data:image", "Height", "Velocity", "truth"):
            self.assertIn(word, page)
        self.assertEqual(len((self.folder / "result/trajectory.tum").read_text().splitlines()), scans["posed"])
        poses = self.run_json("evaluate", "trajectory", "result/trajectory.tum", self.flight / "groundtruth.txt",
                              "--set", "trajectory_error.association=interpolate")
        self.assertAlmostEqual(poses["ate_rmse_m"], run["ate_rmse_m"], places=3)

    def poses(self, path):
        rows = (self.folder / path).read_text().splitlines()
        return {row.split()[0]: [float(number) for number in row.split()[1:]] for row in rows if row[0] != "#"}

    def test_odometry_and_loops_are_switches(self):
        short = ["--set", "laser.duration_s=8", "--quiet", "--set", "laser.pictures=false"]
        plain = self.run_json("laser", self.flight, "-o", "plain", "--set", "laser.close_loops=false", *short)
        self.assertIsNone(plain["loops"])
        self.assertFalse((self.folder / "plain/map_frame.csv").exists())
        run = self.run_json("laser", self.flight, "-o", "wheels", "--set", "laser.degraded_odometry=true", *short)
        self.assertTrue(any("simulated wheel odometry" in choice for choice in run["choices"]), run["choices"])
        self.assertTrue(any("seed 1" in choice for choice in run["choices"]))
        # The control frame does not depend on loops.
        loops = self.run_json("laser", self.flight, "-o", "loops", *short)
        self.assertEqual(loops["path_length_odom_m"], plain["path_length_odom_m"])
        self.assertEqual((self.folder / "loops/trajectory_odom.tum").read_bytes(),
                         (self.folder / "plain/trajectory.tum").read_bytes())
        (self.folder / "bare").mkdir()
        for name in ("recording.bag", "rig.toml"):
            shutil.copy(self.flight / name, self.folder / "bare" / name)
        document = self.run_json("laser", "bare", "--set", "laser.degraded_odometry=true", expect=2)
        self.assertIn("true poses", document["error"]["message"])

    def test_place_in_a_saved_map(self):
        short = ["--quiet", "--set", "laser.pictures=false"]
        self.run_json("laser", self.flight, "-o", "mapped", *short)
        self.simulate("second", 480, "room", "--sensor", "laser_mav", "--seed", 9)
        truth_first = self.poses(self.flight / "groundtruth.txt")
        truth_second = self.poses("second/groundtruth.txt")
        stamps_second = [(float(stamp), stamp) for stamp in truth_second]
        start = next(iter(truth_first.values()))
        # `map` is the first pose of the first flight, level.
        yaw = math.atan2(2 * (start[6] * start[5] + start[3] * start[4]), 1 - 2 * (start[4]**2 + start[5]**2))
        for saved in ("mapped", "mapped/map.yaml", "mapped/map.mvog"):
            with self.subTest(saved):
                # It begins in mid-flight: its own odom lies elsewhere.
                run = self.run_json("laser", "second", "-o", "again", "--overwrite", "--localise", saved, "--set",
                                    "laser.begin_s=6", *short)
                place = run["localisation"]
                self.assertGreater(place["located"], 0.9 * place["scans"])
                self.assertTrue(place["sure"], place)
                self.assertLess(place["first_fix_s"], 3)
                self.assertIsNone(run["loops"])
                errors = []
                for stamp, pose in self.poses("again/trajectory.tum").items():
                    time_s = float(stamp)
                    distance_s, near = min((abs(other_s - time_s), other) for other_s, other in stamps_second)
                    if distance_s < 0.005:
                        x = start[0] + math.cos(yaw) * pose[0] - math.sin(yaw) * pose[1]
                        y = start[1] + math.sin(yaw) * pose[0] + math.cos(yaw) * pose[1]
                        errors.append(math.hypot(x - truth_second[near][0], y - truth_second[near][1]))
                self.assertGreater(len(errors), 100)
                errors.sort()
                self.assertLess(errors[len(errors) // 2], 0.06)
                self.assertLess(errors[-1], 0.25)
        report = json.loads((self.folder / "again/report.json").read_text())
        self.assertEqual(len(report["T_map_odom_history"]["time_s"]), report["localisation"]["changes"])
        self.assertIn("Place in the map", (self.folder / "again/report.html").read_text())

    def test_what_is_no_map(self):
        (self.folder / "text.yaml").write_text("hello\n")
        (self.folder / "noise.mvog").write_bytes(b"no map at all")
        (self.folder / "empty").mkdir()
        for name, word in (("nowhere", "no such map"), ("text.yaml", "text.yaml:1"), ("noise.mvog", "noise.mvog"),
                           ("empty", "not a map"), (self.flight / "recording.bag", "not a map")):
            with self.subTest(str(name)):
                document = self.run_json("laser", self.flight, "-o", "x", "--localise", name, expect=3)
                self.assertIn(word, json.dumps(document["error"]))
                self.assertFalse((self.folder / "x").exists())
        (self.folder / "free.pgm").write_bytes(b"P5\n40 40\n255\n" + bytes([254]) * 1600)
        (self.folder / "free.yaml").write_text("image: free.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n"
                                               "occupied_thresh: 0.65\nfree_thresh: 0.196\n")
        document = self.run_json("laser", self.flight, "--localise", "free.yaml", expect=3)
        self.assertIn("nothing in this map is occupied", document["error"]["message"])

    def test_same_result_again_and_relations(self):
        lines = []
        for row in (self.flight / "groundtruth.txt").read_text().splitlines():
            if not row.startswith("#"):
                lines.append(row.split())
        stamps = [lines[index][0] for index in (len(lines) // 4, len(lines) // 2)]
        (self.folder / "still.relations").write_text(f"{stamps[0]} {stamps[0]} 0 0 0 0 0 0\n"
                                                     f"{stamps[0]} {stamps[1]} 500 0 0 0 0 0\n")
        short = ["--set", "laser.duration_s=8", "--quiet", "--set", "laser.pictures=false"]
        run = self.run_json("laser", self.flight, "-o", "one", "--relations", "still.relations", *short)
        # A pose relative to itself is exact; 500 m are wrong by 500 m, up to the size of the room.
        self.assertEqual(run["relations"], {"used": 2, "unmatched": 0})
        self.assertAlmostEqual(run["relation_error_m"]["mean"], 250, delta=10)
        self.run_hm("laser", self.flight, "-o", "two", *short)
        for name in ("trajectory.tum", "map.mvog", "map.bt", "map.pgm", "height.csv"):
            self.assertEqual((self.folder / "one" / name).read_bytes(), (self.folder / "two" / name).read_bytes(), name)

    def test_realtime_takes_its_time(self):
        began = time.monotonic()
        run = self.run_json("laser", self.flight, "-o", "live", "--pace", "realtime", "--set", "laser.duration_s=3",
                            "--set", "laser.pictures=false")
        self.assertGreater(time.monotonic() - began, 2.9)
        scans = run["scans"]
        self.assertEqual(scans["read"] + scans["dropped"], scans["total"])
        self.assertGreater(scans["read"], 5)

    def test_interrupt_finishes_with_what_there_is(self):
        process = self.start("laser", self.flight, "-o", "stopped", "--pace", "realtime", "--json", "--set",
                             "laser.pictures=false")
        self.addCleanup(process.kill)
        time.sleep(4)
        document, _ = self.interrupt(process)
        self.assertLess(document["scans"]["read"], document["scans"]["total"])
        self.assertTrue(any("stopped after" in warning for warning in document["warnings"]))
        self.check_files("stopped", FILES)

    def test_a_memory_cap_is_said_and_judged(self):
        run = self.run_json("laser", self.flight, "-o", "result", "--set", "mvog.max_map_mb=1", "--set",
                            "mvog.resolution_m=0.02", "--set", "laser.pictures=false", "--set", "laser.duration_s=8")
        self.assertGreater(run["columns_refused"], 0)
        self.assertTrue(any("cap of 1 MB (mvog.max_map_mb)" in warning for warning in run["warnings"]), run["warnings"])
        self.assertNotEqual(run["verdict"]["value"], "ok")

    def test_wrong_input(self):
        self.simulate("pictures", 2)
        document = self.run_json("laser", "pictures", expect=3)
        self.assertIn("hm reconstruct", document["error"]["message"])
        document = self.run_json("reconstruct", self.flight, expect=3)
        self.assertIn("hm laser", document["error"]["message"])
        self.run_json("laser", "nowhere.bag", expect=3)
        (self.folder / "noise.log").write_text("this is no recording\n" * 50)
        self.run_json("laser", "noise.log", expect=3)
        self.run_json("laser", self.flight, "--relations", "nowhere.relations", expect=3)
        (self.folder / "bad.relations").write_text("1 2 3\n")
        document = self.run_json("laser", self.flight, "--relations", "bad.relations", expect=3)
        self.assertIn("bad.relations", json.dumps(document["error"]))
        self.run_json("laser", self.flight, "--set", "laser.slice_top_m=-5", expect=2)
        self.run_json("laser", self.flight, "--set", "laser.poses=odometry", expect=2)
        document = self.run_json("laser", self.flight, "-o", "late", "--set", "laser.begin_s=100000", expect=3)
        self.assertIn("begin_s", document["error"]["message"])
        (self.folder / "file").write_text("")
        self.run_json("laser", self.flight, "-o", "file/result", expect=2)
        bag = self.folder / "cut.bag"
        whole = next(self.flight.glob("*.bag")).read_bytes()
        bag.write_bytes(whole[:len(whole) // 2])
        self.assertGreater(self.run_json("laser", bag, "-o", "cut")["scans"]["posed"], 5)

    def test_real_recordings(self):
        data = support.real_data()
        if not data or not (data / "laser").is_dir():
            self.skipTest("no real recordings in $HM_DATA or ../shared/data")
        for name, (poses, share, path_m, area_m2) in REAL.items():
            with self.subTest(name):
                run = self.run_json("laser", data / name, "-o", Path(name).stem, "--set", "laser.pictures=false")
                self.assertEqual(run["poses"], poses)
                self.assertGreaterEqual(run["scans"]["posed"], share * run["scans"]["read"])
                self.assertTrue(path_m[0] < run["path_length_m"] < path_m[1], run["path_length_m"])
                self.assertTrue(area_m2[0] < run["mvog"]["area_m2"] < area_m2[1], run["mvog"])
                self.check_files(Path(name).stem, FILES)
        self.run_json("laser", data / "bags/imu_tools_ardrone_imu.bag", expect=3)  # no scan in it

    def intel(self, data, result, *more):
        return self.run_json("laser", data / INTEL, "-o", result, "--relations", data / "laser/intel.relations",
                             "--quiet", "--set", "relation_error.max_gap_s=0", "--set",
                             "relation_error.max_extrapolation_s=0", "--set", "laser.pictures=false", *more)

    def test_intel_with_wheels_and_without(self):
        data = support.real_data()
        if not data or not (data / INTEL).exists():
            self.skipTest("no real recordings in $HM_DATA or ../shared/data")
        run = self.intel(data, "wheels", "--set", "laser.degraded_odometry=true")
        self.assertEqual(run["relations"]["used"], 301)
        self.assertGreaterEqual(run["scans"]["posed"], 2660)
        self.assertGreater(run["loops"]["accepted"], 50)
        self.assertEqual(run["loops"]["candidates"],
                         run["loops"]["accepted"] - run["loops"]["removed"] + run["loops"]["rejected"])
        self.assertLess(run["relation_error_m"]["mean"], 0.022)
        self.assertLess(run["relation_error_odom_m"]["mean"], 0.10)
        self.assertLess(run["ate_rmse_m"], min(0.2, run["ate_rmse_odom_m"]))
        # Walls that were seen twice are one wall.
        self.assertLess(run["mvog"]["volumes_positive"], 0.9 * run["loops"]["mvog_odom"]["volumes_positive"])
        self.check_files("wheels", FILES + ["trajectory_odom.tum", "map_frame.csv"])
        alone = self.intel(data, "alone")
        self.assertGreater(alone["scans"]["searched"], 500)
        self.assertGreaterEqual(alone["scans"]["posed"], 2660)
        self.assertLess(alone["relation_error_m"]["mean"], 0.05)
        # A wrong map is not presented as right.
        self.assertTrue(alone["ate_rmse_m"] < 0.5 or alone["verdict"]["value"] != "ok")


if __name__ == "__main__":
    support.main()
