"""hm simulate --sensor laser_mav: a flight with a laser; its files, keys, seeds, a stop."""
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


if __name__ == "__main__":
    support.main()
