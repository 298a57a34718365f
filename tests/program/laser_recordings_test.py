"""hm info of laser recordings: bags of rosbag's own recorder, damaged ones, text logs, real ones."""
import math
import subprocess

import support

TOOL = support.SOURCE / "tests/program/rosbag_tool.py"


class LaserRecordings(support.ProgramTest):
    def write_bag(self, name, compression="none"):
        result = subprocess.run(["/usr/bin/python3", TOOL, "write", self.folder / name, compression],
                                capture_output=True, text=True)
        if result.returncode == 77:
            self.skipTest(result.stdout.strip())
        self.assertEqual(result.returncode, 0, result.stderr)
        return self.folder / name

    def test_bags_of_rosbag(self):
        for compression in ("none", "bz2", "lz4"):
            with self.subTest(compression):
                self.write_bag("a.bag", compression)
                info = self.run_json("info", "a.bag")
                self.assertEqual(info["path_kind"], "laser_recording")
                self.assertEqual((info["kind"], info["warnings"], info["notes"]),
                                 ("ROS bag", [], ["/height: mount of the range sensor from transforms base -> somewhere"]))
                laser, = info["lasers"]
                self.assertEqual((laser["name"], laser["count"], laser["beams"]), ("/scan", 100, 241))
                self.assertAlmostEqual(laser["rate_hz"], 10, 3)
                self.assertAlmostEqual(laser["angle_max_rad"], 1.5, 6)
                self.assertAlmostEqual(laser["angle_increment_rad"], 0.0125, 9)
                self.assertAlmostEqual(laser["latency_s"], 0.005, 9)
                self.assertEqual(laser["nearest_m"], 1)
                self.assertAlmostEqual(laser["farthest_m"], 1 + 235 / 64 + 99 / 1024, 6)
                self.assertAlmostEqual(laser["returns_ratio"], 236 / 241)
                self.assertAlmostEqual(laser["invalid_ratio"], 2 / 241)
                markers = {m["range_m"] if m["range_m"] == "inf" else round(m["range_m"], 3): m["count"]
                           for m in laser["sentinels"]}
                self.assertEqual(markers, {0: 100, "inf": 100, 5.6: 100})
                self.assertEqual((info["imu"]["count"], info["imu"]["has_orientation"]), (1000, True))
                self.assertAlmostEqual(info["imu"]["still_force_m_s2"], 9.75)
                self.assertEqual((info["odometry"]["count"], info["ranges"]["count"]), (200, 200))
                self.assertAlmostEqual(info["odometry"]["path_length_m"], 19.9)
                self.assertAlmostEqual(info["truth"]["path_length_m"], 39.8)
                self.assertIn("/vicon/pose", info["truth_source"])
                mount = laser["mount"]
                self.assertEqual(mount["source"], "transforms base -> somewhere")
                self.assertEqual([round(x, 9) for x in mount["xyz_m"]], [0.5, 0, 0])  # twice upside down
                self.assertEqual([round(abs(x), 9) for x in mount["rpy_rad"]], [0, 0, 0])
                self.assertIn("/odom", info["odometry_source"])

    def test_a_cut_off_bag_is_read_to_the_cut(self):
        whole = self.write_bag("a.bag").read_bytes()
        (self.folder / "cut.bag").write_bytes(whole[:len(whole) // 10])
        info = self.run_json("info", "cut.bag")
        self.assertGreater(info["lasers"][0]["count"], 20)
        self.assertLess(info["lasers"][0]["count"], 100)
        self.assertRegex(" ".join(info["warnings"]), "cut off|ends inside")
        text = self.run_hm("info", "cut.bag").stdout
        self.assertRegex(text, "LOOKS WRONG.*(cut off|ends inside)")

    def test_topics_can_be_named(self):
        self.write_bag("a.bag")
        self.assertEqual(self.run_json("info", "a.bag", "--imu-topic", "/imu/data")["imu"]["count"], 1000)
        failed = self.run_json("info", "a.bag", "--imu-topic", "/imu/other", expect=3)
        self.assertIn("/imu/other", failed["error"]["message"])
        self.assertIn("topics of the bag", failed["error"]["message"])
        self.assertIn("/imu/data (sensor_msgs/Imu, 1000)", failed["error"]["message"])

    def log(self, name, lines):
        (self.folder / name).write_text("".join(line + "\n" for line in lines))

    def flaser(self, i, ranges, stamp):
        return f"FLASER 180 {' '.join(map(str, ranges))} {0.1 * i} 0 0 {0.1 * i} 0 0 {stamp} host {stamp}"

    def test_what_looks_wrong_is_said(self):
        good = [2 + 0.01 * k for k in range(180)]
        self.log("good.log", [self.flaser(i, [r + 0.001 * i for r in good], 100 + 0.1 * i) for i in range(50)])
        self.assertEqual(self.run_json("info", "good.log")["warnings"], [])
        self.assertIn("looks right", self.run_hm("info", "good.log").stdout)
        cases = {
            "frozen": (lambda i: self.flaser(i, good, 100 + 0.1 * i), "equal the one before"),
            "blind": (lambda i: self.flaser(i, [81.83] * 180, 100 + 0.1 * i), "only 0.0 % of the beams return"),
            "same": (lambda i: self.flaser(i, [3] * 180, 100 + 0.1 * i), "all ranges are 3 m"),
            "marker": (lambda i: self.flaser(i, [29.9] * 60 + [r + 0.001 * i for r in good[60:]], 100 + 0.1 * i),
                       "perhaps a marker"),
            "backwards": (lambda i: self.flaser(i, good, 100 + 0.1 * (i if i != 20 else 3)), "run backwards"),
            "gap": (lambda i: self.flaser(i, good, 100 + 0.1 * i + (7 if i > 20 else 0)), "longest 7.10 s"),
            "jump": (lambda i: self.flaser(i + (90 if i > 9 else 0), good, 100 + 0.1 * i), "odometry jumps 1 time,"),
            "still": (lambda i: self.flaser(0, good, 100 + 0.2 * i), "odometry does not move"),
            "degrees": (lambda i: f"FLASER 180 {' '.join(str(r + 0.001 * i) for r in good)} 0 0 {9 * i} 0 0 {9 * i} {i} host {i}",
                        "look like degrees"),
            "old": (lambda i: self.flaser(i, good, 100 + 0.1 * i) if i != 5 else "FLASER 180 " + " 2" * 180,
                    "no poses after the 180 ranges"),
            "broken": (lambda i: self.flaser(i, good, 100 + 0.1 * i) if i != 5 else "FLASER 180 1 2", "malformed"),
        }
        for name, (make, warning) in cases.items():
            with self.subTest(name):
                self.log(name + ".log", [make(i) for i in range(50)])
                self.assertIn(warning, " ".join(self.run_json("info", name + ".log")["warnings"]))

    def imu_folder(self, name, force, samples=400):
        folder = self.folder / name / "imu0"
        folder.mkdir(parents=True)
        lines = ["#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y,w_RS_S_z,a_RS_S_x,a_RS_S_y,a_RS_S_z"]
        for i in range(samples):
            shake = 0.001 * math.sin(i)
            lines.append(f"{1403715523912140000 + 5000000 * i},{shake},0,0.01,0,{shake},{force}")
        (folder / "data.csv").write_text("\n".join(lines) + "\n")

    def test_units_of_an_imu(self):
        for name, force, warning in (("right", 9.81, None), ("g", 1.0, "in g"), ("mg", 1000, "thousandths"),
                                     ("free", 0.0, "taken out"), ("off", 12.0, "instead of 9.81")):
            with self.subTest(name):
                self.imu_folder(name, force)
                warnings = " ".join(w for w in self.run_json("info", name)["warnings"] if w.startswith("imu"))
                if warning:
                    self.assertIn(warning, warnings)
                else:
                    self.assertEqual(warnings, "")

    def test_millimetres_are_refused_before_a_run(self):
        ranges = [2000 + 10 * k for k in range(180)]
        self.log("mm.log", ["PARAM laser_front_laser_max 50000 1 host 1"]
                 + [self.flaser(i, [r + i for r in ranges], 100 + 0.1 * i) for i in range(50)])
        self.assertIn("millimetres", " ".join(self.run_json("info", "mm.log")["warnings"]))
        failed = self.run_json("laser", "mm.log", "-o", "out", expect=3)
        self.assertIn("are the ranges in millimetres?", failed["error"]["message"])
        self.assertIn("--force", failed["error"]["message"])
        self.assertFalse((self.folder / "out").exists())

    def test_other_verbs_say_what_it_is(self):
        self.log("a.log", [self.flaser(i, [3 + i] * 180, 100 + i) for i in range(3)])
        failed = self.run_json("reconstruct", "a.log", "-o", "x", expect=3)
        self.assertIn("laser recording", failed["error"]["message"])
        self.assertIn("hm laser", failed["error"]["message"])
        refused = self.run_json("convert", "a.log", "x.ply", expect=2)
        self.assertIn("hm laser", refused["error"]["message"])

    def test_real_recordings(self):
        data = support.real_data()
        if data is None:
            self.skipTest("no real recordings")
        for path, scans, beams in (("bags/scan_tools_laser_demo.bag", 360, 681),
                                   ("laser/flirt_intel-lab.log", 2671, 180),
                                   ("laser/wean_robotdata1.log", 713, 180),
                                   ("laser/ncd_QuadTree_Alog.alog", 263, 181),
                                   ("laser/breezyslam_exp1.dat", 756, 682)):
            with self.subTest(path):
                laser = self.run_json("info", data / path)["lasers"][0]
                self.assertEqual((laser["count"], laser["beams"]), (scans, beams))
        self.assertEqual(self.run_json("info", data / "imu/euroc_V1_02_medium")["imu"]["count"], 7999)


if __name__ == "__main__":
    support.main()
