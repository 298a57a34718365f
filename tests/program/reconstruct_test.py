"""A simulated recording through the whole program: results, accuracy, reports, the same bits for any thread count."""
import json
import re
import shutil

import support

RECONSTRUCT_KEYS = {"frames", "integrate_ms", "mesh_ms", "volumes", "map_bytes", "voxel_size_m", "vertices",
                    "triangles", "bounds_m", "surface_error_mm", "completeness_ratio"}
RESULT_FILES = ["mesh.ply", "mesh.glb", "map.hmap", "trajectory.tum", "parameters.toml", "report.json", "report.html",
                "floor_plan.svg"]
FEW_SAMPLES = ["--set", "mesh_error.samples=200000"]
PLAIN = ["--set", "reconstruction.pictures=false", "--set", "mesh_error.samples=20000"]


class Reconstruct(support.ProgramTest):
    def test_room_end_to_end(self):
        simulated = self.run_json("simulate", "room", "-o", "recording", "--frames", "40")
        self.assertEqual(simulated["frames"], 40)
        run = self.run_json("reconstruct", "recording", "-o", "result", "--voxel", "0.03", *FEW_SAMPLES)
        self.assertLessEqual(RECONSTRUCT_KEYS, set(run))
        self.assertEqual(run["frames"], {"total": 40, "read": 40, "integrated": 40, "skipped": 0})
        self.assertEqual(run["voxel_size_m"], 0.03)
        self.check_numbers(run)
        self.check_files(run)
        self.check_evaluations(run)
        self.check_conversions(run)

    def test_align_corrects_drifting_poses(self):
        self.run_json("simulate", "room", "-o", "recording", "--sensor", "kinect", "--drift", "--set",
                      "simulation.frame_stride=10", "--set", "simulation.drift_ratio=0.03", "--set",
                      "simulation.drift_yaw_rad_m=0.01")
        run = self.run_json("reconstruct", "recording", "-o", "aligned", "--align", "--voxel", "0.03", *PLAIN)
        alignment = run["alignment"]
        self.assertGreater(alignment["accepted"], 4 * alignment["not_accepted"])
        self.assertLess(alignment["ate_aligned_m"], 0.5 * alignment["ate_given_m"])
        self.assertGreater(alignment["align_ms"]["median"], 0)
        self.assertIn("Alignment", (self.folder / "aligned/report.html").read_text())
        self.assertNotIn("alignment", self.run_json("reconstruct", "recording", "-o", "given", *PLAIN, "--set",
                                                       "reconstruction.frame_limit=4"))

    def check_numbers(self, run):
        # The room is 6 x 4 x 2.8 m with walls; the tablet's noise at 4 m is 30 mm.
        low, high = run["bounds_m"]["min"], run["bounds_m"]["max"]
        for axis, size in enumerate((6.0, 4.0, 2.8)):
            self.assertLess(high[axis] - low[axis], size + 0.6)
            self.assertGreater(high[axis] - low[axis], size * 0.4)
        self.assertLess(run["surface_error_mm"]["mean"], 12)
        self.assertLess(abs(run["surface_error_mm"]["bias"]), 4)
        self.assertGreater(run["completeness_ratio"], 0.8)
        self.assertGreater(run["triangles"], run["vertices"])
        self.assertGreater(run["integrate_ms"]["p99"], 0)
        self.assertGreaterEqual(run["integrate_ms"]["p99"], run["integrate_ms"]["median"])

    def check_files(self, run):
        result = self.folder / "result"
        for name in RESULT_FILES:
            self.assertGreater((result / name).stat().st_size, 100, name)
        pictures = {path.name for path in (result / "pictures").iterdir()}
        self.assertLessEqual({"shaded.png", "color.png", "height.png", "plan.png", "error.png"}, pictures)
        page = (result / "report.html").read_text()
        self.assertNotRegex(page, r"<script[^>]*src|<link|src=[\"']?http|url\(http", "the page is not self-contained")
        for word in ("<svg", "data:image", "voxel_size_m", "Memory", "Time"):
            self.assertIn(word, page)
        report = json.loads((result / "report.json").read_text())
        self.assertEqual(report["triangles"], run["triangles"])
        self.assertEqual(len(report["series"]["integrate_ms"]), 40)
        self.run_hm("params", "check", "result/parameters.toml")
        self.assertIn("voxel_size_m = 0.03", (result / "parameters.toml").read_text())

    def check_evaluations(self, run):
        poses = self.run_json("evaluate", "trajectory", "result/trajectory.tum", "recording", "--set",
                              "trajectory_error.alignment=none")
        self.assertEqual(poses["what"], "trajectory")
        self.assertEqual(poses["pairs"], 40)
        self.assertLess(poses["ate_rmse_m"], 1e-6)
        self.assertLess(poses["rpe_translation_rmse_m"], 1e-6)
        self.assertLess(poses["rpe_rotation_rmse_rad"], 1e-4)
        mesh = self.run_json("evaluate", "mesh", "result/mesh.ply", "recording", "--report", "mesh.html", *FEW_SAMPLES)
        self.assertAlmostEqual(mesh["accuracy_mm"]["mean"], run["surface_error_mm"]["mean"], places=9)
        self.assertAlmostEqual(mesh["completeness_ratio"], run["completeness_ratio"], places=9)
        self.assertIn("<svg", (self.folder / "mesh.html").read_text())
        # A mesh compared with itself is exact: the check that the measure is not blind.
        exact = self.run_json("evaluate", "mesh", "recording/truth_mesh.ply", "recording", *FEW_SAMPLES)
        self.assertLess(exact["accuracy_mm"]["p95"], 0.01)
        self.assertGreater(exact["completeness_ratio"], 0.9999)

    def check_conversions(self, run):
        info = self.run_json("info", "result/map.hmap")
        self.assertEqual((info["path_kind"], info["volumes"]), ("map", run["volumes"]))
        self.run_hm("convert", "result/map.hmap", "again.ply")
        self.assertEqual((self.folder / "again.ply").read_bytes(), (self.folder / "result/mesh.ply").read_bytes())
        for name in ("mesh.obj", "mesh.glb"):
            self.run_hm("convert", "result/mesh.ply", name)
            other = self.run_json("info", name)
            self.assertEqual((other["vertices"], other["triangles"]), (run["vertices"], run["triangles"]))
        self.run_hm("convert", "result/mesh.ply", "small.ply", "--set", "mesh.simplify_keep_ratio=0.2")
        self.assertLess(self.run_json("info", "small.ply")["triangles"], 0.4 * run["triangles"])
        self.run_hm("convert", "result/trajectory.tum", "poses.kitti")
        lines = (self.folder / "poses.kitti").read_text().splitlines()
        self.assertEqual(len(lines), 40)
        by_number = self.run_json("reconstruct", "recording", "--poses", "poses.kitti", "-o", "by_number", "--voxel", "0.03", *PLAIN)
        self.assertEqual(by_number["frames"], run["frames"])
        self.assertAlmostEqual(by_number["triangles"] / run["triangles"], 1, delta=1e-3)
        (self.folder / "many.kitti").write_text("\n".join(lines + lines[-1:]) + "\n")
        error = self.run_hm("reconstruct", "recording", "--poses", "many.kitti", "-o", "none", expect=3)
        self.assertIn("holds 41 poses without stamps, and the recording 40 frames", error.stderr)
        copied = self.run_json("convert", "recording", "copy")
        self.assertEqual((copied["items"], copied["skipped"]), (40, 0))
        self.run_hm("reconstruct", "copy", "-o", "of_copy", "--voxel", "0.03", "--quiet", *PLAIN)
        self.assertEqual((self.folder / "of_copy/mesh.ply").read_bytes(),
                         (self.folder / "result/mesh.ply").read_bytes())

    def test_same_bits_for_any_number_of_threads_and_any_run(self):
        self.simulate(frames=16)
        meshes = []
        for name, threads, more in (("one", 1, []), ("two", 2, []), ("five", 5, ["reconstruction.mesh_budget_ms=0.1"]),
                                    ("late", 2, ["reconstruction.live_mesh=false"]),
                                    ("plain", 2, ["tsdf.kernel=scalar"])):
            words = [word for assignment in more for word in ("--set", assignment)]
            self.run_hm("reconstruct", "recording", "-o", name, "--threads", threads, "--quiet", *PLAIN, *words)
            meshes.append((self.folder / name / "mesh.ply").read_bytes())
        self.assertTrue(all(mesh == meshes[0] for mesh in meshes))

    def test_default_output_quiet_and_silence(self):
        self.simulate(frames=3)
        result = self.run_hm("reconstruct", "recording", "--quiet", *PLAIN)
        self.assertEqual((result.stdout, result.stderr), ("", ""))
        self.assertTrue((self.folder / "recording_reconstruction/mesh.ply").exists())

    def test_bad_frames_are_named_and_the_run_goes_on(self):
        folder = self.simulate(frames=12)
        pictures = sorted((folder / "depth").iterdir())
        pictures[3].write_bytes(pictures[3].read_bytes()[:200])
        pictures[5].unlink()
        truth = folder / "groundtruth.txt"
        lines = truth.read_text().splitlines()
        truth.write_text("\n".join(lines[:-2]) + "\n")  # the last two frames lose their poses
        run = self.run_json("reconstruct", "recording", "-o", "result", *PLAIN)
        reasons = {frame["index"]: frame["reason"] for frame in run["skipped_frames"]}
        self.assertEqual(run["frames"]["integrated"], 12 - len(reasons))
        self.assertEqual(run["frames"]["skipped"], len(reasons))
        self.assertIn(pictures[3].name, reasons[3])
        self.assertIn(pictures[5].name, reasons[5])
        self.assertTrue(any("pose" in reason for reason in reasons.values()), reasons)
        self.assertTrue(any("skipped" in warning for warning in run["warnings"]))

    def test_nothing_to_integrate_says_why(self):
        folder = self.simulate(frames=4)
        document = self.run_json("reconstruct", "recording", "--depth-units-per-m", "500000", "--force", expect=3)
        self.assertRegex(document["error"]["message"], r"not one of 4 frames .*4 x ")
        shutil.rmtree(folder / "depth")
        (folder / "depth").mkdir()
        document = self.run_json("reconstruct", "recording", expect=3)
        self.assertTrue(re.search(r"recording", json.dumps(document["error"])))

    def test_memory_cap(self):
        self.simulate(frames=20)
        run = self.run_json("reconstruct", "recording", "-o", "result", "--set", "tsdf.max_map_mb=2", *PLAIN)
        self.assertLessEqual(run["map_bytes"], 2_000_000)
        self.assertGreater(run["volumes_refused"], 0)
        self.assertTrue(any("memory cap of 2 MB" in warning for warning in run["warnings"]))
        self.assertNotEqual(run["verdict"]["value"], "ok")
        self.assertEqual(run["frames"]["integrated"] + run["frames"]["skipped"], 20)
        self.assertGreater(run["triangles"], 1000)


if __name__ == "__main__":
    support.main()
