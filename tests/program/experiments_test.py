"""hm evaluate depth-compensation and hm evaluate uncertainty: the experiments of the dissertation's Fig. 3.16 and 3.8."""
import json

import support

SET = "calibration_simulation"


class Experiments(support.ProgramTest):
    def test_depth_compensation(self):
        self.run_hm("simulate", "calibration", "-o", "boards", "--sensor", "tango_phone", "--quiet", "--set", f"{SET}.depth_steps=4",
                    "--set", f"{SET}.test_steps=2", "--set", f"{SET}.camera_views=3", "--set", f"{SET}.stereo_views=1",
                    "--set", f"{SET}.depth_images=4")
        boards = self.run_json("calibrate", "depth", "boards/depth", "--calibration", "boards/truth", "-o", "phone")
        self.assertLess(boards["after_rms_m"], 0.2 * boards["before_rms_m"])
        self.run_hm("simulate", "house", "-o", "walk", "--sensor", "tango_phone", "--frames", 20, "--quiet")
        result = self.run_json("evaluate", "depth-compensation", "walk", "--calibration", "phone/calibration.toml", "-o",
                               "compared", "--voxel", "0.04", "--set", "mesh_error.samples=50000")
        without, compensated = result["without"], result["with"]
        self.assertEqual(without["frames"], 20)
        self.assertEqual(without["keyframes"], compensated["keyframes"])
        # A bias of up to 30 cm at 3 m against the sensor's noise of some millimetres.
        self.assertLess(compensated["surface_error_mm"]["mean"], 0.3 * without["surface_error_mm"]["mean"])
        self.assertLess(compensated["point_error"]["mean_mm"], 0.4 * without["point_error"]["mean_mm"])
        self.assertGreater(compensated["cell_error"]["near_ratio"], without["cell_error"]["near_ratio"] + 0.1)
        self.assertGreater(compensated["completeness_ratio"], without["completeness_ratio"] + 0.1)
        for name in ("plan", "shaded", "error", "occupancy"):
            self.assertGreater((self.folder / f"compared/pictures/{name}.png").stat().st_size, 1000)
        for side in ("without", "with"):
            self.check_results(f"compared/{side}", ["mesh.ply", "points.ply", "occupancy.ot"], ["surface error"])
        page = (self.folder / "compared/report.html").read_text()
        self.assertIn("With depth compensation the surface is", page)
        self.assertEqual(json.loads((self.folder / "compared/report.json").read_text())["with"], compensated)
        # The one that is without keeps the cameras, and the one with the correction is not touched.
        self.assertNotIn("depth_correction", (self.folder / "compared/without/calibration.toml").read_text())
        self.assertIn("depth_camera", (self.folder / "compared/without/calibration.toml").read_text())
        self.assertIn("depth_correction", (self.folder / "phone/calibration.toml").read_text())
        # Nothing to compare: no correction, no calibration at all.
        none = self.run_hm("evaluate", "depth-compensation", "walk", "--calibration", "boards/truth/calibration.toml", "-o", "x",
                           expect=2)
        self.assertIn("hm calibrate depth", none.stderr)
        self.run_hm("evaluate", "depth-compensation", "walk", "-o", "x", expect=3)

    def test_boards_of_devices(self):
        for words in (["calibration", "--sensor", "laser_mav"], ["house", "--sensor", "xtion"],
                      ["calibration", "--sensor", "kinect", "--perfect"]):
            self.assertIn("hm: --", self.run_hm("simulate", *words, "-o", "x", expect=2).stderr)

    def test_uncertainty(self):
        result = self.run_json("evaluate", "uncertainty", "-o", "simulated", "--views", 1, "--frames", 40)
        self.assertEqual(result["frames"], 40)
        errors = result["rms_error_mm"]
        self.assertEqual(set(errors), {"quadratic", "corrected_mixture", "mixture_4_2_1", "mixture_10_3_1", "mixture_4_1_0"})
        self.assertLess(errors["mixture_4_2_1"]["edges"], 0.7 * errors["quadratic"]["edges"])
        self.assertLess(errors["quadratic"]["planes"], errors["mixture_4_2_1"]["planes"])
        self.assertGreater(result["pixels"]["features"], 50)
        page = (self.folder / "simulated/report.html").read_text()
        for words in ("depth edges", "features", "Actual and predicted deviation", "10/3/1"):
            self.assertIn(words, page)
        for name in ("actual", "color", "quadratic", "corrected_mixture"):
            self.assertTrue((self.folder / f"simulated/pictures/{name}.png").exists())
        # A camera that is carried is no still scene, and it is said.
        self.simulate("walk", 12, "room", "--sensor", "kinect", "--set", "simulation.frame_stride=15")
        moving = self.run_json("evaluate", "uncertainty", "walk", "-o", "moving")
        self.assertIn("did camera or scene move?", " ".join(moving["warnings"]))
        self.simulate("short", 4)
        self.assertIn("at least 10", self.run_hm("evaluate", "uncertainty", "short", "-o", "x", expect=3).stderr)

    def test_flight_experiments(self):
        hover = self.run_json("experiment", "hover", "--tiny", "-o", "hover")
        row = {row["quantity"]: row for row in hover["experiments"][0]["rows"]}["default control: |z| at most, by the estimate"]
        self.assertEqual((row["published"], row["unit"]), (5, "cm"))
        self.assertLess(row["measured"], 10)
        self.assertTrue((self.folder / "hover/published/core.trace").exists())
        # The seed is a parameter: another flight.
        runs = [self.run_json("experiment", "height", "--tiny", "-o", f"height_{seed}", "--set", f"flight.seed={seed}") for seed in (1, 2)]
        self.assertNotEqual(runs[0]["experiments"][0]["rows"], runs[1]["experiments"][0]["rows"])
        self.assertIn("did you mean 'hover'", self.run_hm("experiment", "hoover", expect=2).stderr)


if __name__ == "__main__":
    support.main()
