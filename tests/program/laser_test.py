"""hm laser: a simulated flight end to end, every real laser recording where it is there, Ctrl-C, wrong input."""
import json
import shutil
import signal
import time
from pathlib import Path

import support

KEYS = {"scans", "match_ms", "path_length_m", "mvog", "insert_us_per_beam", "choices", "bounds_m"}
FILES = ["trajectory.txt", "map.mvog", "map.bt", "map.ply", "map.yaml", "map.pgm", "parameters.toml", "report.json",
         "report.html"]
# Recording -> (poses from, least share of scans with a pose, path between, area of the map between, m and m2).
REAL = {
    "bags/scan_tools_laser_demo.bag": ("scans", 1.0, (4, 9), (10, 40)),
    "laser/wean_robotdata1.log": ("scans", 0.98, (30, 60), (80, 400)),
    "laser/breezyslam_exp1.dat": ("scans", 0.98, (30, 70), (80, 500)),
    "laser/ncd_QuadTree_Alog.alog": ("odometry", 0.99, (2, 6), (50, 160)),
}


class Laser(support.ProgramTest):
    def setUp(self):
        super().setUp()
        if not hasattr(Laser, "flight"):
            Laser.keeper = Laser("run_hm")  # its folder outlives the single tests
            support.ProgramTest.setUp(Laser.keeper)
            Laser.keeper.run_hm("simulate", "room", "-o", "flight", "--sensor", "laser_mav", "--frames", "480",
                                "--quiet")
            Laser.flight = Laser.keeper.folder / "flight"

    @classmethod
    def tearDownClass(cls):
        if hasattr(cls, "keeper"):
            shutil.rmtree(cls.keeper.folder, ignore_errors=True)

    def check_files(self, result, names):
        for name in names:
            self.assertGreater((self.folder / result / name).stat().st_size, 20, name)
        page = (self.folder / result / "report.html").read_text()
        self.assertNotRegex(page, r"<script|<link|src=[\"']?http|url\(http", "the page is not self-contained")
        self.assertIn("<svg", page)
        json.loads((self.folder / result / "report.json").read_text())
        self.run_hm("params", "check", f"{result}/parameters.toml")

    def test_flight_end_to_end(self):
        run = self.run_json("laser", self.flight, "-o", "result")
        self.assertLessEqual(KEYS | {"ate_rmse_m", "height_rmse_m", "floors"}, set(run))
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
        self.assertEqual(len((self.folder / "result/trajectory.txt").read_text().splitlines()), scans["posed"])
        poses = self.run_json("evaluate", "trajectory", "result/trajectory.txt", self.flight / "groundtruth.txt",
                              "--set", "trajectory_error.association=interpolate")
        self.assertAlmostEqual(poses["ate_rmse_m"], run["ate_rmse_m"], places=3)

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
        for name in ("trajectory.txt", "map.mvog", "map.bt", "map.pgm", "height.csv"):
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
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 0, errors)
        document = json.loads(output)
        self.assertTrue(document["interrupted"])
        self.assertLess(document["scans"]["read"], document["scans"]["total"])
        self.assertTrue(any("stopped after" in warning for warning in document["warnings"]))
        self.check_files("stopped", FILES)

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
                run = self.run_json("laser", data / name, "-o", Path(name).stem)
                self.assertEqual(run["poses"], poses)
                self.assertGreaterEqual(run["scans"]["posed"], share * run["scans"]["read"])
                self.assertTrue(path_m[0] < run["path_length_m"] < path_m[1], run["path_length_m"])
                self.assertTrue(area_m2[0] < run["mvog"]["area_m2"] < area_m2[1], run["mvog"])
                self.check_files(Path(name).stem, FILES)
        run = self.run_json("laser", data / "laser/flirt_intel-lab.log", "-o", "intel", "--relations",
                            data / "laser/intel.relations")
        self.assertGreater(run["relations"]["used"], 100)
        self.assertIn("ate_rmse_m", run)
        self.assertEqual(run["scans"]["restarts"] > 0, any("lost" in warning for warning in run["warnings"]))
        self.run_json("laser", data / "bags/imu_tools_ardrone_imu.bag", expect=3)  # no scan in it


if __name__ == "__main__":
    support.main()
