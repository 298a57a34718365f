"""The program of dense reconstruction only (HM_PARTS=dense): what it does, what it says of the other verbs."""
import json
import shutil
import subprocess
import unittest
from pathlib import Path

import support

DENSE = Path(support.PROGRAM).resolve().with_name("hm_dense")
REST = [["odometry", "x"], ["slam", "x"], ["laser", "x"], ["calibrate", "intrinsics", "x"],
        ["evaluate", "uncertainty", "-o", "x"], ["evaluate", "depth-compensation", "x", "-o", "y"],
        ["simulate", "calibration"]]


class DenseProgram(support.ProgramTest):
    def dense(self, *words, expect=0):
        done = subprocess.run([DENSE, *map(str, words)], capture_output=True, text=True, cwd=self.folder, timeout=300)
        self.assertEqual(done.returncode, expect, done.stdout + done.stderr)
        return done

    def test_other_verbs_are_not_built_and_that_is_said(self):
        for words in REST:
            with self.subTest(" ".join(words)):
                errors = self.dense(*words, expect=2).stderr
                self.assertIn("./hm build all", errors)
                self.assertIn(f"'{words[0]}", errors)
        answer = json.loads(self.dense("slam", "x", "--json", expect=2).stdout)
        self.assertEqual(answer["error"]["code"], "usage")

    def test_parameters_of_other_verbs_are_named_as_such(self):
        self.dense("params", "show", "--set", "tsdf.voxel_size_m=0.03")
        self.assertIn("./hm build all",
                      self.dense("params", "show", "--set", "laser.queue_scans=3", expect=2).stderr)

    def test_a_room_is_simulated_and_reconstructed(self):
        self.dense("simulate", "room", "-o", "room", "--frames", 5)
        self.dense("reconstruct", "room", "-o", "result", "--set", "mesh_error.samples=20000")
        self.assertTrue((self.folder / "result/mesh.ply").exists())
        self.dense("info", "result/map.hmap")

    @unittest.skipUnless(shutil.which("ldd"), "ldd is not here")
    def test_it_needs_neither_opencv_nor_ceres(self):
        libraries = subprocess.run(["ldd", DENSE], capture_output=True, text=True, check=True).stdout
        self.assertNotIn("opencv", libraries)
        self.assertNotIn("ceres", libraries)


if __name__ == "__main__":
    support.main()
