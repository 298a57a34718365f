"""hm experiment: every figure and table in its tiny form, from simulations only; what each measures is plausible."""
import json
import os
import shutil
import tempfile
from functools import lru_cache
from pathlib import Path

import support

NAMES = ["height", "hover", "waypoints", "corridor", "floor-map", "flight-map", "grid", "hallway-grid", "depth-bias", "uncertainty",
         "places", "odometry", "large-map", "depth-images", "phone-bias", "filters", "alignment", "phone-room", "integration", "desk",
         "volumes", "memory", "scan-times"]


@lru_cache(maxsize=None)
def tiny_run():
    """All experiments in their tiny form: the report, and the folder."""
    case = support.ProgramTest()
    case.folder = Path(tempfile.mkdtemp(prefix="hm_experiments_"))
    report = case.run_json("experiment", "all", "--tiny", "-o", "all", HM_DATA="")
    return report, case.folder


def tearDownModule():
    if tiny_run.cache_info().currsize:
        shutil.rmtree(tiny_run()[1], ignore_errors=True)


class TinyExperiments(support.ProgramTest):
    def rows(self, name):
        for entry in tiny_run()[0]["experiments"]:
            if entry["name"] == name:
                return {row["quantity"]: row["measured"] for row in entry["rows"]}
        self.fail(f"{name} was not run")

    def between(self, rows, quantity, low, high):
        self.assertGreaterEqual(rows[quantity], low, quantity)
        self.assertLessEqual(rows[quantity], high, quantity)

    def test_pages(self):
        report, folder = tiny_run()
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
