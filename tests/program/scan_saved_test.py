"""hm scan saves map and recording within a second of the camera's end. On an idle computer: ctest runs this file alone."""
import json
import os
import subprocess
from pathlib import Path

import support
from scans import ScanTest

FAKENECT = Path("/usr/lib/x86_64-linux-gnu/fakenect")


class ScanIsSavedSoon(ScanTest):
    def check_saved(self, capture):
        """Map and recording within a second of the end."""
        self.assertGreater(capture["saved_s"], 0)
        self.assertLessEqual(capture["saved_s"], 1)

    def test_unplugged(self):
        run = self.replay("-o", "result", "--unplug-after", "1.2", expect=1)
        self.check_capture(run["capture"])
        self.assertIn("unplugged after 1.2 s", run["error"]["message"])
        self.check_saved(run["capture"])
        self.assertEqual(self.run_json("info", "result/recording")["frames"], run["capture"]["recorded"])
        self.assertTrue(self.run_json("info", "result/map.hmap")["ok"])
        poses = (self.folder / "result/trajectory.tum").read_text().splitlines()
        self.assertEqual(len(poses), run["capture"]["tracked"])
        self.assertGreater((self.folder / "result/mesh.ply").stat().st_size, 1000)
        self.assertEqual(json.loads((self.folder / "result/run.json").read_text())["state"], "stopped")
        # Plugged in again: one recording, one map.
        more = self.replay("-o", "result", "--resume")
        self.check_capture(more["capture"])
        self.assertEqual(more["capture"]["earlier_frames"], run["capture"]["recorded"])
        self.assertEqual(run["capture"]["captured"] + more["capture"]["captured"], 60)
        self.assertEqual(self.run_json("info", "result/recording")["frames"], 60)
        self.assertEqual(more["loops"]["maps"], 1)

    def test_openni_unplugged(self):
        run = self.run_with(self.openni(HM_OPENNI_FRAMES="30"), "--camera", "openni", "-o", "result", expect=1)
        self.check_capture(run["capture"])
        self.assertIn("unplugged", run["error"]["message"])
        self.check_saved(run["capture"])
        self.assertEqual(self.run_json("info", "result/recording")["frames"], run["capture"]["recorded"])

    def test_freenect(self):
        writer = os.environ.get("HM_WRITE_FAKENECT")
        if not writer or not FAKENECT.is_dir():
            self.skipTest("no libfreenect with its stand-in")
        (self.folder / "fake").mkdir()
        subprocess.run([writer, self.recording, "fake", "40"], cwd=self.folder, check=True, timeout=120)
        (self.folder / "kinect.toml").write_text(
            "[depth_camera]\nsize_px = [640, 480]\nfx_px = 525\nfy_px = 525\ncx_px = 319.5\ncy_px = 239.5\n"
            "[color_camera]\nsize_px = [640, 480]\nfx_px = 525\nfy_px = 525\ncx_px = 319.5\ncy_px = 239.5\n"
            "[T_color_depth]\nxyz_m = [0, 0, 0]\nquaternion_xyzw = [0, 0, 0, 1]\n"
            "[depth_disparity]\noffset_per_m = 3.3309495161\nslope_per_m = -0.0030711016\n")
        run = self.run_with({"LD_LIBRARY_PATH": str(FAKENECT), "FAKENECT_PATH": str(self.folder / "fake")},
                            "--camera", "freenect", "--calibration", "kinect.toml", "-o", "result", expect=1)
        self.check_capture(run["capture"])
        self.assertIn("unplugged?", run["error"]["message"])  # the files have ended
        self.assertGreater(run["capture"]["tracked"], 5)
        self.check_saved(run["capture"])
        self.assertEqual(self.run_json("info", "result/recording")["frames"], run["capture"]["recorded"])


if __name__ == "__main__":
    support.main()
