"""hm simulate: a flight with a laser (--sensor laser_mav) and a drive through an office; files, keys, seeds, a stop; a torn map."""
import hashlib
import json
import signal
import time

import support

FILES = ["groundtruth.txt", "recording.bag", "rig.toml", "simulation.toml", "truth_floor.txt", "truth_mesh.ply"]


class LaserSimulation(support.ProgramTest):
    def fly(self, name, *more, world="room", scans=120):
        return self.run_json("simulate", world, "--sensor", "laser_mav", "-o", name, "--frames", scans, *more)

    def digest(self, name):
        return hashlib.sha256((self.folder / name / "recording.bag").read_bytes()).hexdigest()

    def test_files_and_keys(self):
        document = self.fly("flight", scans=400)
        self.assertEqual(sorted(path.name for path in (self.folder / "flight").iterdir()), FILES)
        self.assertEqual(document["scans"], 400)
        self.assertGreaterEqual(document["imu_samples"], 400 / 40 * 200)
        self.assertEqual(document["odometry_readings"], 0)
        self.assertAlmostEqual(document["duration_s"], 10, delta=0.1)
        self.assertGreater(document["path_length_m"], 0.8)  # it took off
        self.assertGreater(document["valid_ratio"], 0.9)
        self.assertGreater(document["max_tilt_rad"], 0.005)
        self.assertEqual((self.folder / "flight/recording.bag").read_bytes()[:13], b"#ROSBAG V2.0\n")

    def test_seeds_and_switches(self):
        self.fly("a", "--seed", 3)
        self.fly("b", "--seed", 3, "--threads", 1)
        self.fly("c", "--seed", 4)
        self.fly("d", "--seed", 3, "--set", "laser_simulation.mixed_readings=false")
        self.fly("e", "--seed", 3, "--perfect")
        digests = [self.digest(name) for name in "abcde"]
        self.assertEqual(digests[0], digests[1])
        self.assertEqual(len(set(digests)), 4)
        self.assertGreater(self.fly("f", "--drift")["odometry_readings"], 50)
        # A folder that holds a recording is not overwritten, and parameters have ranges.
        self.run_json("simulate", "room", "--sensor", "laser_mav", "-o", "a", expect=2)
        self.run_json("simulate", "room", "--sensor", "laser_mav", "-o", "g", "--set",
                      "laser_simulation.imu_rate_hz=5000", expect=2)

    def test_parameters_in_effect_are_read_back(self):
        self.fly("a", "--set", "laser_simulation.speed_m_s=1.5", "--seed", 9)
        self.run_json("simulate", "--sensor", "laser_mav", "-o", "b", "--params", "a/simulation.toml")
        self.assertEqual(self.digest("a"), self.digest("b"))

    def test_stopped(self):
        process = self.start("simulate", "house", "--sensor", "laser_mav", "-o", "house", "--json")
        self.addCleanup(process.kill)
        while process.poll() is None and not (self.folder / "house/recording.bag.partial").exists():
            time.sleep(0.01)
        self.assertIsNone(process.poll(), "it ended before it could be stopped")
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 1, errors)
        error = json.loads(output)["error"]
        self.assertEqual(error["code"], "cancelled")
        self.assertRegex(error["message"], r"stopped at scan \d+ of \d+; nothing of it was kept")
        self.assertFalse((self.folder / "house").exists())


OFFICE_FILES = ["groundtruth.txt", "recording.bag", "rig.toml", "simulation.toml"]


class OfficeSimulation(support.ProgramTest):
    def drive(self, name, *more):
        return self.run_json("simulate", "office", "-o", name, *more)

    def digest(self, name):
        return hashlib.sha256((self.folder / name / "recording.bag").read_bytes()).hexdigest()

    def test_files_keys_and_seeds(self):
        document = self.drive("a", "--frames", 40, "--seed", 3)
        self.assertEqual(sorted(path.name for path in (self.folder / "a").iterdir()), OFFICE_FILES)
        self.assertEqual((document["scans"], document["seed"]), (40, 3))
        self.assertGreater(document["path_length_m"], 15)
        self.assertAlmostEqual(document["wheel_path_length_m"] / document["path_length_m"], 1.035, delta=0.03)
        self.drive("b", "--frames", 40, "--seed", 3)
        self.drive("c", "--frames", 40, "--seed", 4)
        self.drive("d", "--frames", 40, "--seed", 3, "--sensor", "laser_robot_8m")
        digests = [self.digest(name) for name in "abcd"]
        self.assertEqual(digests[0], digests[1])
        self.assertEqual(len(set(digests)), 3)
        info = self.run_json("info", "d")
        self.assertLess(info["lasers"][0]["farthest_m"], 8.1)
        self.assertEqual(info["odometry"]["count"], 40)

    def test_wrong_words(self):
        self.drive("a", "--frames", 5)
        self.run_json("simulate", "office", "-o", "a", expect=2)
        self.run_json("simulate", "office", "-o", "b", "--sensor", "kinect", expect=2)
        self.run_json("simulate", "house", "-o", "b", "--sensor", "laser_robot", expect=2)
        self.assertFalse((self.folder / "b").exists())

    def test_laser_on_it(self):
        self.drive("office", "--frames", 150, "--seed", 1)
        run = self.run_json("laser", "office", "-o", "result", "--set", "laser.pictures=false")
        self.assertEqual(run["scans"]["posed"], 150)
        self.assertLess(run["ate_rmse_m"], 1)
        self.assertLess(run["scans"]["unconfirmed"], 30)
        self.assertEqual(run["pieces"], [])
        self.assertFalse((self.folder / "result/pieces").exists())

    def test_a_torn_map_comes_in_pieces(self):
        self.drive("office", "--seed", 2)
        # Without loops drift is not corrected, and the visits of a place contradict each other.
        words = ["laser", "office", "-o", "result", "--overwrite", "--set", "laser.pictures=false"]
        torn = ["--set", "laser_loops.min_score=1"]
        run = self.run_json(*words, *torn)
        self.assertEqual(run["verdict"]["value"], "broken", run["verdict"])
        self.assertEqual(run["loops"]["accepted"], 0)
        pieces = run["pieces"]
        self.assertGreaterEqual(len(pieces), 2)
        report = json.loads((self.folder / "result/report.json").read_text())
        self.assertEqual(report["pieces"], pieces)
        self.assertIn("How the pieces lie", (self.folder / "result/report.html").read_text())
        for before, piece in zip([None, *pieces], pieces):
            self.assertGreaterEqual(piece["scans"], 10)
            self.assertTrue(before is None or before["end_s"] < piece["begin_s"])
            path = self.folder / "result" / piece["map"]
            self.assertEqual(len(path.with_suffix(".txt").read_text().splitlines()), piece["scans"])
            self.assertIn(f"image: {path.stem}.pgm", path.read_text())
            self.assertTrue(path.with_suffix(".pgm").read_bytes().startswith(b"P5"))
        text = self.run_hm(*words, *torn).stdout
        self.assertRegex(text, rf"pieces +a map of each of {len(pieces)} pieces")


if __name__ == "__main__":
    support.main()
