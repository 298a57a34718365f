"""Real recordings, where they are there ($HM_DATA or ../shared/data): sane numbers, nothing skipped without reason."""
import sys

import support

# Folder -> (frames, least share integrated, triangles between, longest edge of the box between, metres).
EXPECTED = {
    "rgbd/tum_fr1_xyz": (101, 0.95, (30_000, 900_000), (1.5, 12)),
    "rgbd/icl_of_kt3": (30, 1.0, (30_000, 900_000), (1.5, 12)),
    "rgbd/sevenscenes_a": (600, 1.0, (100_000, 2_500_000), (2, 14)),
}


class RealRecordings(support.ProgramTest):
    def test_each_reconstructs(self):
        for name, (frames, share, triangles, edge_m) in EXPECTED.items():
            with self.subTest(name):
                recording = support.real_data() / name
                run = self.run_json("reconstruct", recording, "-o", name.replace("/", "_"), "--voxel", "0.02", "--set",
                                    "reconstruction.pictures=false")
                self.assertEqual(run["frames"]["total"], frames)
                self.assertGreaterEqual(run["frames"]["integrated"], share * frames)
                self.assertEqual(run["frames"]["skipped"], len(run["skipped_frames"]))
                self.assertTrue(triangles[0] < run["triangles"] < triangles[1], run["triangles"])
                bounds = run["bounds_m"]
                longest = max(high - low for low, high in zip(bounds["min"], bounds["max"]))
                self.assertTrue(edge_m[0] < longest < edge_m[1], bounds)
                self.assertLess(run["map_bytes"], 400_000_000)

    def test_info_of_each(self):
        for name, (frames, *_) in EXPECTED.items():
            with self.subTest(name):
                info = self.run_json("info", support.real_data() / name)
                self.assertIn(str(frames), self.run_hm("info", support.real_data() / name).stdout)
                self.assertEqual(info["path_kind"], "recording")

    def test_a_scan_says_that_colour_is_not_registered(self):
        camera = f"replay:{support.real_data() / 'rgbd/sevenscenes_a'}"
        run = self.run_json("scan", "--camera", camera, "--speed", "3", "--seconds", "6", "-o", "scanned", "--voxel", "0.06",
                            "--set", "reconstruction.pictures=false", "--set", "slam.matrices=false")
        said = [warning for warning in run["warnings"] if "colour is not registered to depth" in warning]
        self.assertEqual(len(said), 1, run["warnings"])


if __name__ == "__main__":
    if not support.real_data():
        print("skipped: no real recordings in $HM_DATA or ../shared/data")
        sys.exit(77)
    support.main()
