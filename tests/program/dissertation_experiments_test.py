"""hm experiment: every figure and table in its tiny form, from simulations only; what each measures is plausible."""
import json
import shutil
import tempfile
import unittest
from pathlib import Path

import support

NAMES = ["height", "hover", "waypoints", "corridor", "floor-map", "flight-map", "grid", "hallway-grid", "depth-bias", "uncertainty",
         "places", "odometry", "large-map", "depth-images", "phone-bias", "filters", "alignment", "phone-room", "integration", "desk",
         "volumes", "memory", "scan-times"]


def setUpModule():
    """Runs all experiments in their tiny form, once."""
    global REPORT, FOLDER
    case = support.ProgramTest()
    case.folder = FOLDER = Path(tempfile.mkdtemp(prefix="hm_experiments_"))
    unittest.addModuleCleanup(shutil.rmtree, FOLDER, ignore_errors=True)
    REPORT = case.run_json("experiment", "all", "--tiny", "-o", "all", HM_DATA="")


class TinyExperiments(support.ProgramTest):
    def rows(self, name):
        for entry in REPORT["experiments"]:
            if entry["name"] == name:
                return {row["quantity"]: row["measured"] for row in entry["rows"]}
        self.fail(f"{name} was not run")

    def between(self, rows, quantity, low, high):
        self.assertGreaterEqual(rows[quantity], low, quantity)
        self.assertLessEqual(rows[quantity], high, quantity)

    def test_pages(self):
        report, folder = REPORT, FOLDER
        self.assertEqual([entry["name"] for entry in self.run_json("experiment", "list")["experiments"]], NAMES)
        self.assertEqual([entry["name"] for entry in report["experiments"]], NAMES)
        self.assertEqual(report["failed"], [])
        index = (folder / "all/report.html").read_text()
        for entry in report["experiments"]:
            page = (folder / "all" / entry["name"] / "report.html").read_text()
            self.assertIn(entry["figure"], page)
            self.assertIn(entry["figure"], index)
            self.assertTrue("<svg" in page or "<img" in page, entry["name"])
            self.assertGreater(len(entry["rows"]), 2)
            self.assertEqual(json.loads((folder / "all" / entry["name"] / "report.json").read_text())["rows"], entry["rows"])

    def test_flights(self):
        for name in ("corridor", "floor-map", "flight-map"):
            rows = self.rows(name)
            self.between(rows, "scans with a pose", 98, 100)
            self.between(rows, "length of the path", 2, 20)
            self.between(rows, "position error, RMS", 0, 5)
            self.between(rows, "error of the height, RMS", 0, 2)
        self.assertGreater(self.rows("corridor")["points"], 100_000)

    def test_grids(self):
        for name, least_occupied in (("grid", 80), ("hallway-grid", 60)):
            rows = self.rows(name)
            self.between(rows, "scans left out, grid: end points occupied", least_occupied, 100)
            self.between(rows, "scans left out, grid: points on beams free", 98, 100)
            self.assertLess(rows["scans left out, published structure: end points occupied"],
                            rows["scans left out, grid: end points occupied"])
            self.assertLess(rows["0.10 m: grid, in memory"], 0.5 * rows["0.10 m: dense array of 1 B a cell"])
            self.assertLess(rows["0.10 m: octree with the same voxels, as a file"], rows["0.10 m: grid, in memory"])
            self.between(rows, "0.10 m: the same of the published structure", 500, 20_000)
        self.assertLess(self.rows("grid")["0.20 m: grid, in memory"], 0.5 * self.rows("grid")["0.05 m: grid, in memory"])

    def test_depth_bias(self):
        for name, left in (("depth-bias", 0.05), ("phone-bias", 0.15)):
            rows = self.rows(name)
            at_3m = "bias over the image at 3.0 m: RMS "
            self.assertLess(rows[at_3m + "after"], left * rows[at_3m + "before"], name)
            boards = next(quantity for quantity in rows if quantity.startswith("boards near 3"))[:len("boards near 3.22 m: ")]
            self.assertLess(rows[boards + "RMS after"], 1.5 * rows[boards + "noise of the averaged readings"], name)
            self.assertGreater(rows[boards + "RMS before"], 2 * rows[boards + "RMS after"], name)
        self.between(self.rows("phone-bias"), "bias over the image at 3.0 m: largest before", 28, 31)

    def test_compensated_maps(self):
        for name in ("large-map", "phone-room"):
            rows = self.rows(name)
            for quantity, ratio in (("distance of the mesh from the true surface, mean", 0.3),
                                    ("distance of the points of keyframes, mean", 0.4)):
                self.assertLess(rows["with correction: " + quantity], ratio * rows["without correction: " + quantity], quantity)
            self.between(rows, "with correction: true surface reconstructed within 2 cm", 80, 100)
            self.assertLess(rows["without correction: true surface reconstructed within 2 cm"], 60)

    def test_places(self):
        rows = self.rows("places")
        self.assertEqual(rows["keyframes"], 14)
        self.assertGreater(rows["brute force: associations"], 3)
        self.assertLess(rows["brute force: of them false"], 0.2 * rows["brute force: associations"])
        self.between(rows, "n = 10, k = 4: associations found", 75, 100)

    def test_odometry(self):
        rows = self.rows("odometry")
        for method, most_cm in (("published pipeline", 2), ("tracker", 0.5)):
            name = f"simulated kinect in the house, {method}: "
            self.between(rows, name + "position error, RMS", 0.0001, most_cm)
            self.assertEqual(rows[name + "frames without a pose"], 0)
            self.assertGreater(rows[name + "points in the model at the end"], 100)

    def test_depth_images(self):
        rows = self.rows("depth-images")
        for device in ("tango_phone", "tango_tablet", "kinect"):
            self.between(rows, f"{device}: pixels with a reading", 60, 99)
        self.between(rows, "tango_tablet: depth off at 2.5 to 3 m, median", 0.1, 2)
        self.assertGreater(rows["tango_phone: depth off at 2.5 to 3 m, median"], 3 * rows["tango_tablet: depth off at 2.5 to 3 m, median"])

    def test_filters(self):
        rows = self.rows("filters")
        coarse, fine = "distance in units of 0.1 mm, ", next(q for q in rows if "the map's units" in q).split(", ")[0] + ", "
        self.assertGreater(rows[coarse + "rounded: error after 1500"], 2)  # it stalls
        self.between(rows, coarse + "as implemented: error after 1500", 0, 0.3)
        self.between(rows, fine + "as implemented: error after 1500", 0, 0.08)
        self.between(rows, fine + "exact mean: error after 1500", 0, 0.05)
        self.assertGreater(rows["colour, 40 to 200, rounded towards zero: error after 300"], 10)
        self.between(rows, "colour, 40 to 200, as implemented: error after 300", 0, 1)

    def test_alignment(self):
        rows = self.rows("alignment")
        for quantity in ("position error, RMS", "distance of the mesh from the true surface, mean"):
            self.assertLess(rows["dense alignment: " + quantity], rows["poses as given: " + quantity])
        self.between(rows, "scans aligned", 80, 100)
        self.between(rows, "dense alignment: distance of the mesh from the true surface, mean", 0.5, 8)

    def test_integration(self):
        rows = self.rows("integration")
        for method in ("traversal, colour", "projection, colour"):
            self.assertLess(rows[f"{method}, carving: surface farther than 5 cm from the true one"],
                            rows[f"{method}: surface farther than 5 cm from the true one"] - 0.5)
            self.between(rows, f"{method}, carving: distance from the true surface, median", 0.1, 5)
            self.between(rows, f"{method}, carving: true surface reconstructed within 2 cm", 85, 100)
            self.between(rows, f"{method}, carving: colour off by", 0.5, 10)
        times = self.rows("scan-times")
        self.assertEqual(len(times), 18)
        self.assertTrue(all(value > 0 for value in times.values()), times)

    def test_desk_and_memory(self):
        desk = self.rows("desk")
        self.between(desk, "readings that meet the mesh", 85, 100)
        self.between(desk, "distance of a reading from the mesh, median", 0.5, 8)
        volumes = self.rows("volumes")
        counts = [volumes[f"{edge} cm: volumes changed by a scan, mean"] for edge in (2, 3, 5)]
        self.assertEqual(counts, sorted(counts, reverse=True))
        self.between(volumes, "3 cm: share of the volumes in the frustum", 2, 30)
        memory = self.rows("memory")
        for name in ("corridor of 15 m, 3 cm", "desk, 2 cm, up to 5 m", "desk, 2 cm, up to 2 m"):
            self.between(memory, f"{name}: fixed / hashed", 2, 20)
            self.between(memory, f"{name}: hashed grid", 0.2, 5)

    def test_data(self):
        """A recording of the folder of data is used, and one that is damaged is an error that names it."""
        self.simulate("data/rgbd/tum_fr1_xyz", 6, "room", "--sensor", "kinect")
        run = self.run_json("experiment", "desk", "--tiny", "-o", "desk", "--data", "data")
        self.assertEqual({row["quantity"]: row["measured"] for row in run["experiments"][0]["rows"]}["frames"], 5)
        self.assertNotIn("is absent", " ".join(run["warnings"]))
        self.assertIn("recording tum_fr1_xyz", (self.folder / "desk/report.html").read_text())
        for file in (self.folder / "data/rgbd/tum_fr1_xyz").glob("*.txt"):
            file.unlink()
        self.assertIn("tum_fr1_xyz", self.run_hm("experiment", "desk", "--tiny", "-o", "x", "--data", "data", expect=3).stderr)
        self.assertIn("--data", self.run_hm("experiment", "desk", "--tiny", "-o", "x", "--data", "none", expect=2).stderr)


if __name__ == "__main__":
    support.main()
