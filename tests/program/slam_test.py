"""hm slam: a walk around a simulated room end to end, its maps, the same again, wrong input, a real recording."""
import json
import re
import shutil
import time

import support

KEYS = {"frames", "track_ms", "path_length_m", "keyframes", "loops", "model_points", "map_correction", "mesh",
        "bundle_adjustment", "ate_rmse_m", "rpe_frame_m", "rpe_second_m", "rpe_second_rad", "odometry", "frames_mapped",
        "live_corrections", "longest_stall_ms", "frame_ms"}
PARTS = {"frames": {"read", "tracked", "lost"}, "track_ms": {"median", "mean", "p99"},
         "loops": {"candidates", "accepted"}, "frame_ms": {"median", "mean", "p99"},
         "odometry": {"ate_rmse_m", "rpe_frame_m", "rpe_second_m", "rpe_second_rad"}}
FILES = ["trajectory.tum", "odometry.tum", "keyframes.tum", "graph.g2o", "mesh.ply", "mesh.glb", "map.hmap",
         "parameters.toml", "report.json", "report.html"]
COARSE = ["--voxel", "0.05", "--set", "mesh_error.samples=50000"]


class Slam(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        Slam.recording = keeper.simulate("room", 70, "room", "--sensor", "kinect")
        if data := support.real_data():
            Slam.desk = keeper.run_json("slam", data / "rgbd/tum_fr1_xyz", "-o", "desk", *COARSE)
            Slam.desk_folder = keeper.folder / "desk"

    def check_files(self, result, names):
        self.check_results(result, names, ("<svg", "data:image", "From above", "Loops", "rebuilt from the recording"))

    def test_room_end_to_end_with_maps(self):
        run = self.run_json("slam", self.recording, "-o", "result", "--maps", "points,octomap,mvog", *COARSE)
        self.assertLessEqual(KEYS | {"mesh_error"}, set(run))
        for key, parts in PARTS.items():
            self.assertLessEqual(parts, set(run[key]), key)
        for key in ("path_length_m", "keyframes", "model_points"):
            self.assertGreater(run[key], 1, key)
        self.assertEqual(run["frames"]["tracked"], 70)
        self.assertEqual(run["frames_mapped"], 70)
        self.assertLess(run["ate_rmse_m"], 0.03)
        self.assertLess(run["mesh_error"]["accuracy_mm"]["mean"], 25)
        self.assertGreater(run["mesh"]["triangles"], 1000)
        self.assertLessEqual(run["loops"]["accepted"], run["loops"]["candidates"])
        self.check_files("result", FILES + ["points.ply", "occupancy.ot", "volumes.mvog"])
        poses = self.run_json("evaluate", "trajectory", "result/trajectory.tum", self.recording)
        self.assertAlmostEqual(poses["ate_rmse_m"], run["ate_rmse_m"], places=6)
        before = self.run_json("evaluate", "trajectory", "result/odometry.tum", self.recording)
        self.assertAlmostEqual(before["ate_rmse_m"], run["odometry"]["ate_rmse_m"], places=6)
        graph = (self.folder / "result/graph.g2o").read_text()
        self.assertEqual(graph.count("VERTEX_SE3"), run["keyframes"])
        self.assertGreaterEqual(graph.count("EDGE_SE3"), run["keyframes"] - 1)
        shown = self.run_json("info", "result/graph.g2o")
        self.assertEqual((shown["path_kind"], shown["dimensions"]), ("pose_graph", 3))
        self.assertEqual(shown["nodes"], run["keyframes"])
        self.assertEqual(shown["odometry_edges"] + shown["loop_edges"], graph.count("EDGE_SE3"))
        self.assertGreater(shown["path_length_m"], 0.5 * run["path_length_m"])
        head = (self.folder / "result/occupancy.ot").read_bytes()[:200]
        self.assertIn(b"id ColorOcTree", head)
        self.assertIn(b"res 0.05", head)
        self.assertTrue(self.run_json("info", "result/map.hmap")["ok"])

    def test_accepted_loops_are_shown_with_their_images(self):
        if not support.real_data():
            self.skipTest("no real recordings")
        self.assertGreater(self.desk["loops"]["accepted"], 0)
        page = (self.desk_folder / "report.html").read_text()
        shown = re.findall(r"<details><summary>frames (\d+) and (\d+), [\d.]+ s apart: (\d+) matches", page)
        self.assertGreater(len(shown), 0)
        self.assertLessEqual(len(shown), 12)
        self.assertEqual(len(set(shown)), len(shown))
        for first, second, matches in shown:
            self.assertLess(int(first), int(second))
            self.assertGreater(int(matches), 5)

    def test_same_result_again(self):
        # Loops are closed on a thread of their own; what comes out must not depend on its pace.
        for name, threads in (("one", 1), ("two", 2)):
            self.run_hm("slam", self.recording, "-o", name, "--threads", threads, "--quiet", *COARSE, "--set",
                        "reconstruction.pictures=false", "--set", "reconstruction.frame_limit=40", "--set",
                        "slam.matrices=false")
        for name in ("trajectory.tum", "odometry.tum", "keyframes.tum", "graph.g2o", "mesh.ply"):
            self.assertEqual((self.folder / "one" / name).read_bytes(), (self.folder / "two" / name).read_bytes(), name)

    def test_stopped(self):
        process = self.start("slam", self.recording, "-o", "stopped", "--maps", "points,octomap,mvog", "--json",
                             "--voxel", "0.01", "--threads", "1", "--set", "reconstruction.pictures=false")
        self.addCleanup(process.kill)
        for line in process.stderr:
            if line.startswith("tracking"):
                break
        time.sleep(0.3)  # of a second and more
        run, errors = self.interrupt(process, timeout=300)
        self.assertIn("writing the results so far", errors)
        self.assertRegex(" ".join(run["warnings"]), r"stopped after \d+ of 70 frames")
        # All that was tracked is in the map, and every file is there.
        self.assertGreater(run["frames_mapped"], 0)
        self.assertEqual(run["frames_mapped"], run["frames"]["tracked"])
        self.assertGreater(run["volumes"], 10)
        self.assertGreater(run["mesh"]["triangles"], 1000)
        for name in ("mesh.ply", "map.hmap", "points.ply", "occupancy.ot", "volumes.mvog"):
            self.assertGreater((self.folder / "stopped" / name).stat().st_size, 1000, name)

    def test_a_recording_without_poses(self):
        bare = self.folder / "bare"
        shutil.copytree(self.recording, bare)
        for name in ("groundtruth.txt", "poses.txt", "truth_mesh.ply", "truth_visible.ply"):
            (bare / name).unlink(missing_ok=True)
        document = self.run_json("reconstruct", "bare", expect=3)
        self.assertIn("hm slam", document["error"]["message"])
        run = self.run_json("slam", "bare", "-o", "result", *COARSE, "--set", "reconstruction.frame_limit=30")
        self.assertNotIn("ate_rmse_m", run)
        self.assertEqual(run["frames"]["tracked"], 30)
        self.check_files("result", FILES)
        # Held level: the room's floor lies below the first camera, its walls to the sides.
        low, high = run["bounds_m"]["min"], run["bounds_m"]["max"]
        self.assertLess(low[2], -0.5)
        self.assertGreater(high[0], 1)
        mesh = self.run_json("reconstruct", "bare", "-o", "mesh", "--poses", "result/trajectory.tum", *COARSE, "--set",
                             "reconstruction.pictures=false", "--set", "reconstruction.frame_limit=30")
        self.assertEqual(mesh["frames"]["integrated"], 30)
        document = self.run_json("reconstruct", "bare", "-o", "mesh2", "--poses", "nowhere.tum", expect=3)
        self.assertIn("nowhere.tum", json.dumps(document["error"]))

    def test_memory_caps_are_said_and_judged(self):
        run = self.run_json("slam", self.recording, "-o", "result", "--maps", "mvog", "--set", "tsdf.max_map_mb=1", "--set",
                            "mvog.max_map_mb=1", "--set", "mvog.resolution_m=0.01", "--set",
                            "reconstruction.pictures=false", "--set", "mesh_error.samples=20000", "--set", "tsdf.voxel_size_m=0.02", "--set",
                            "reconstruction.frame_limit=40")
        self.assertGreater(run["volumes_refused"], 0)
        for parameter in ("tsdf.max_map_mb", "mvog.max_map_mb"):
            self.assertTrue(any(f"cap of 1 MB ({parameter})" in warning for warning in run["warnings"]), run["warnings"])
        self.assertNotEqual(run["verdict"]["value"], "ok")

    def test_wrong_input(self):
        self.run_json("slam", "nowhere", expect=3)
        document = self.run_json("slam", self.recording, "--maps", "points,globe", expect=2)
        self.assertIn("globe", document["error"]["message"])
        document = self.run_json("slam", self.recording, "--set", "reconstruction.align=true", expect=2)
        self.assertIn("hm reconstruct", document["error"]["message"])
        (self.folder / "file").write_text("")
        self.run_json("slam", self.recording, "-o", "file/result", expect=2)

    def test_real_recording(self):
        if not support.real_data():
            self.skipTest("no real recordings in $HM_DATA or ../shared/data")
        self.assertEqual(self.desk["frames"]["tracked"], 101)
        self.assertLess(self.desk["ate_rmse_m"], 0.03)
        self.check_files(self.desk_folder, FILES)


if __name__ == "__main__":
    support.main()
