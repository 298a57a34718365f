"""hm calibrate and hm simulate calibration: every word end to end on a small simulated set, what readers make of it,
damaged and missing files, Ctrl-C, and the real Kinect pictures where they are there."""
import json
import math
import shutil
import signal
import time
import tomllib

import support

TRUE_RGB = {"fx_px": 537.674, "fy_px": 534.380, "cx_px": 321.226, "cy_px": 249.774}
TRUE_IR = {"fx_px": 578.853, "fy_px": 574.608, "cx_px": 316.004, "cy_px": 246.041}
TRUE_XYZ = [-0.026010, -0.000053, 0.000568]


class Calibrate(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        Calibrate.folder_of_set, report = support.simulated(*support.SMALL_SET)
        assert report["ok"] and report["color_pictures"] == 12 and report["pairs"] == 8, report
        Calibrate.chain(keeper)

    @staticmethod
    def chain(test):
        """All words, one after the other; what they say is kept."""
        the_set = Calibrate.folder_of_set
        Calibrate.color = test.run_json("calibrate", "intrinsics", the_set / "color", "-o", "color")
        Calibrate.ir = test.run_json("calibrate", "intrinsics", the_set / "ir", "-o", "both", "--camera", "depth",
                                     "--calibration", "color")
        Calibrate.rig = test.run_json("calibrate", "extrinsics", the_set / "stereo/ir", the_set / "stereo/color",
                                      "--calibration", "both/calibration.toml", "-o", "rig")
        Calibrate.depth = test.run_json("calibrate", "depth", the_set / "depth", "--calibration", "rig", "-o",
                                        "corrected")
        Calibrate.noise = test.run_json("calibrate", "noise", the_set / "depth", "-o", "noise")
        Calibrate.results = test.folder

    def check_page(self, folder):
        page = (Calibrate.results / folder / "report.html").read_text()
        self.assertNotRegex(page, r"<script[^>]*src|<link|src=[\"']?http|url\(http", "the page is not self-contained")
        report = json.loads((Calibrate.results / folder / "report.json").read_text())
        self.assertTrue(report)
        return page

    def test_intrinsics(self):
        for run, truth in ((self.color, TRUE_RGB), (self.ir, TRUE_IR)):
            for key, value in truth.items():
                self.assertLess(abs(run["camera"][key] / value - 1), 0.01, key)
            self.assertLess(run["rms_px"], 0.1)
            self.assertEqual(len(run["images"]), run["found"]["boards"])
            self.assertGreater(run["deviation"]["fx"], 0.01)
        self.assertIn("<img", self.check_page("color"))
        self.assertIn("plumb_bob", (Calibrate.results / "color/color_camera_info.yaml").read_text())

    def test_extrinsics(self):
        xyz = self.rig["T_color_depth"]["xyz_m"]
        self.assertLess(math.dist(xyz, TRUE_XYZ), 0.002)
        self.assertLess(abs(math.degrees(self.rig["T_color_depth"]["angle_rad"]) - 0.56), 0.3)
        self.check_page("rig")

    def test_depth(self):
        run = self.depth
        self.assertEqual(run["poses"]["left_out"], 0)
        self.assertLess(run["after_rms_m"], 0.5 * run["before_rms_m"])
        for row in run["distances"]:
            self.assertLess(row["after_rms_m"], 1.3 * row["noise_m"] + 0.002, row)
        self.assertEqual(run["model"]["mode"], "spline")
        self.assertIn("<svg", self.check_page("corrected"))
        thesis = self.run_json("calibrate", "depth", self.folder_of_set / "depth", "--calibration",
                               self.results / "rig", "-o", "thesis", "--set", "depth_fit.mode=quadratic_zero")
        self.assertEqual(thesis["model"]["mode"], "quadratic_zero")
        self.assertLess(thesis["after_rms_m"], thesis["before_rms_m"])

    def test_cameras_are_adjusted_with_the_correction(self):
        run = self.run_json("calibrate", "depth", self.folder_of_set / "depth", "--calibration", self.results / "rig",
                            "-o", "refined", "--set", "depth_fit.refine=cameras")
        refined = run["refined"]
        # Every board's pose had the least error of its own corners before: now they share it with the depth.
        self.assertLess(refined["corners_after"], 0.5)
        self.assertLess(refined["depth_after"], refined["depth_before"])
        before, after = (abs(camera["fx_px"] / TRUE_RGB["fx_px"] - 1)
                         for camera in (self.color["camera"], refined["color_camera"]))
        self.assertLess(after, before + 5e-4)
        self.assertLess(run["after_rms_m"], 1.05 * self.depth["after_rms_m"])
        written = tomllib.loads((self.folder / "refined/calibration.toml").read_text())
        self.assertAlmostEqual(written["color_camera"]["fx_px"], refined["color_camera"]["fx_px"], places=6)
        wrong = self.run_json("calibrate", "depth", self.folder_of_set / "depth", "--calibration",
                              self.results / "rig", "-o", "x", "--set", "depth_fit.refine=cameras", "--set",
                              "depth_fit.mode=quadratic", expect=2)
        self.assertIn("spline", wrong["error"]["message"])

    def test_noise(self):
        planes = self.run_json("calibrate", "noise", self.folder_of_set / "depth", "-o", "planes", "--from", "planes")
        for source, run in (("static", self.noise), ("planes", planes)):
            noise = run["depth_noise"]
            for z in (1.0, 2.0, 4.0):
                fitted = noise["quadratic_per_m"] * z * z + noise["linear_ratio"] * z + noise["constant_m"]
                self.assertLess(abs(fitted / (0.001425 * z * z) - 1), 0.12, (source, z))

    def test_noise_is_read_by_the_truncation_model(self):
        run, noise_toml = self.noise, self.results / "noise/noise.toml"
        self.run_hm("params", "check", noise_toml)
        recording = self.simulate(frames=3)
        noise = {key: repr(value) for key, value in run["depth_noise"].items()}
        ways = {"by_file": ["--params", noise_toml],
                "by_set": [word for key, value in noise.items() for word in ("--set", f"depth_noise.{key}={value}")],
                "noisier": ["--params", noise_toml, "--set", "depth_noise.quadratic_per_m=0.02"]}
        meshes = {}
        for name, words in ways.items():
            self.run_hm("reconstruct", recording, "-o", name, "--quiet", "--set", "reconstruction.pictures=false", "--set",
                        "mesh_error.samples=20000", *words)
            meshes[name] = (self.folder / name / "mesh.ply").read_bytes()
        used = tomllib.loads((self.folder / "by_file/parameters.toml").read_text())["depth_noise"]
        for key, value in run["depth_noise"].items():
            self.assertAlmostEqual(used[key], value, delta=1e-9 + 1e-5 * abs(value), msg=key)
        self.assertEqual(meshes["by_file"], meshes["by_set"])
        self.assertNotEqual(meshes["by_file"], meshes["noisier"], "the truncation does not depend on it")

    def test_a_folder_that_cannot_be_made_is_an_error(self):
        (self.folder / "file").write_text("")
        for output in ("file", "file/set"):
            wrong = self.run_json("simulate", *support.SMALL_SET, "-o", output, expect=2)
            self.assertIn("file", wrong["error"]["where"])

    def as_recording(self, pose):
        """A pose of the board as a TUM recording of raw pictures."""
        folder = self.folder / "raw"
        folder.mkdir()
        shutil.copy(self.folder_of_set / pose / "color.png", folder / "rgb.png")
        shutil.copy(self.folder_of_set / pose / "depth_000.png", folder / "depth.png")
        (folder / "rgb.txt").write_text("1.0 rgb.png\n")
        (folder / "depth.txt").write_text("1.0 depth.png\n")
        (folder / "groundtruth.txt").write_text("1.0 0 0 0 0 0 0 1\n")
        return folder

    def test_readers_apply_it(self):
        raw = self.as_recording("depth/test/000")
        self.run_hm("convert", raw, "plain", "--quiet", "--intrinsics", "570", "570", "320", "240",
                    "--depth-units-per-m", "1000")
        self.run_hm("convert", raw, "by_flag", "--quiet", "--depth-units-per-m", "1000", "--calibration",
                    self.results / "corrected/calibration.toml")
        for name in ("calibration.toml", "calibration.hmdc"):
            shutil.copy(self.results / "corrected" / name, raw / name)
        self.run_hm("convert", raw, "by_folder", "--quiet", "--depth-units-per-m", "1000")
        pictures = {name: next((self.folder / name / "depth").glob("*.png")).read_bytes()
                    for name in ("plain", "by_flag", "by_folder")}
        self.assertEqual(pictures["by_flag"], pictures["by_folder"])
        self.assertNotEqual(pictures["by_flag"], pictures["plain"])
        focal = float((self.folder / "by_flag/camera.txt").read_text().split("fx ")[1].split()[0])
        self.assertLess(abs(focal / TRUE_RGB["fx_px"] - 1), 0.01, "registered to the colour camera")
        (raw / "calibration.hmdc").unlink()
        missing = self.run_json("info", raw, expect=3)
        self.assertIn("calibration.hmdc", missing["error"]["where"])

    def test_wrong_input(self):
        pictures = self.folder_of_set / "color"
        self.run_json("calibrate", "intrinsics", "nowhere", "-o", "x", expect=3)
        self.run_json("calibrate", "intrinsics", pictures, "-o", "x", "--corners", "8by6", expect=2)
        one = self.folder / "one"  # four pictures at most are searched for boards of every usual size, which takes a minute
        one.mkdir()
        shutil.copy(pictures / "00.png", one)
        wrong = self.run_json("calibrate", "intrinsics", one, "-o", "x", "--corners", "7x5", expect=3)
        self.assertIn("7 x 5 inner corners", wrong["error"]["message"])
        self.assertIn("try --board checkerboard --corners", wrong["error"]["message"])
        alone = self.run_json("calibrate", "extrinsics", self.folder_of_set / "stereo/ir",
                              self.folder_of_set / "stereo/color", "--calibration", self.results / "color", "-o", "x",
                              expect=2)
        self.assertIn("both cameras", alone["error"]["message"])
        self.run_json("calibrate", "depth", self.folder_of_set / "color", "--calibration", self.results / "rig", "-o",
                      "x", expect=3)
        self.run_json("simulate", "calibration", "-o", self.folder_of_set, expect=2)

    def test_unusable_pictures_are_counted_and_named(self):
        pictures = self.folder / "pictures"
        shutil.copytree(self.folder_of_set / "color", pictures)
        (pictures / "00.png").write_bytes((pictures / "00.png").read_bytes()[:5000])
        (pictures / "01.png").write_bytes(b"")
        (pictures / "02.jpg").write_text("no picture")
        shutil.copy(self.folder_of_set / "depth/train/000/color.png", pictures / "99.png")  # another board
        run = self.run_json("calibrate", "intrinsics", pictures, "-o", "x")
        self.assertEqual(len(run["found"]["unreadable"]), 3)
        self.assertEqual(run["found"]["without_board"], ["99.png"])
        self.assertTrue(any("00.png" in warning for warning in run["warnings"]))
        self.assertTrue(any("99.png" in warning for warning in run["warnings"]))

    def test_ctrl_c_writes_nothing(self):
        process = self.start("simulate", "calibration", "-o", "stopped")
        time.sleep(1.5)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
        self.assertEqual(process.returncode, 1)
        self.assertFalse((self.folder / "stopped").exists())

    def test_real_kinect(self):
        data = support.real_data()
        if data is None or not (data / "calib/dataset_pjinkim_02").is_dir():
            self.skipTest("no real calibration pictures")
        run = self.run_json("calibrate", "intrinsics", data / "calib/dataset_pjinkim_02", "-o", "kinect", "--corners",
                            "8x5", "--square", "0.03")
        self.assertEqual(run["found"]["boards"], 22)
        self.assertLess(run["rms_px"], 0.4)
        for key, low, high in (("fx_px", 510, 550), ("fy_px", 510, 550), ("cx_px", 290, 340), ("cy_px", 215, 270)):
            self.assertTrue(low < run["camera"][key] < high, (key, run["camera"]))
        self.assertTrue(any("cover" in warning for warning in run["warnings"]), "the boards stay in the middle")

    def test_real_kinect_raw_disparity(self):
        data = support.real_data()
        if data is None or not (data / "calib/dataset_pjinkim_02").is_dir():
            self.skipTest("no real calibration pictures")
        the_set, board = data / "calib/dataset_pjinkim_02", ["--corners", "8x5", "--square"]
        few = ["--set", "camera_fit.fit_k3=false", "--set", "camera_fit.fit_tangential=false"]
        self.run_hm("calibrate", "intrinsics", the_set, "-o", "color", "--quiet", *board, "0.0443", *few)
        run = self.run_json("calibrate", "depth", the_set, "--calibration", "color", "-o", "kinect", "--raw-disparity",
                            *board, "0.0443", "--set", "depth_fit.degree=1", "--set", "depth_fit.smoothness_m=0.0005")
        self.assertEqual(run["poses"], {"total": 29, "train": 17, "test": 5, "left_out": 7})
        raw = run["raw_disparity"]
        self.assertLess(raw["after_rms_units"], 0.25 * raw["before_rms_units"])
        self.assertAlmostEqual(raw["slope_per_m"], -0.0030711, delta=1e-4)
        self.assertLess(run["after_rms_m"], run["before_rms_m"])
        self.assertLess(run["after_rms_m"], 0.008)
        # The set does not say how large its squares are: the published constants do.
        wrong = self.run_json("calibrate", "depth", the_set, "--calibration", "color", "-o", "x", "--raw-disparity",
                              *board, "0.03")
        self.assertTrue(any("a square of the board" in warning for warning in wrong["warnings"]), wrong["warnings"])
        noise = self.run_json("calibrate", "noise", the_set, "-o", "noise", "--from", "planes", "--raw-disparity")
        self.assertEqual(noise["images"], 29)
        self.assertAlmostEqual(noise["depth_noise"]["quadratic_per_m"], 0.0014, delta=4e-4)


if __name__ == "__main__":
    support.main()
