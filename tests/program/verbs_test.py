"""Keys and effects of the other verbs: info, simulate, demo, evaluate, params, presets."""
import json

import support

ROOM = ["-o", "demo", "--set", "simulation.frame_limit=30", "--set", "mesh_error.samples=50000"]


class Verbs(support.ProgramTest):
    def test_info_of_a_recording(self):
        self.simulate(frames=40)
        info = self.run_json("info", "recording")
        self.assertEqual(info["path_kind"], "recording")
        text = self.run_hm("info", "recording").stdout
        for word in ("320", "180", "40"):
            self.assertIn(word, text)

    def test_info_of_a_pose_graph(self):
        path = self.folder / "square.g2o"
        information = "1 0 0 1 0 1"
        square = [f"VERTEX_SE2 {i} {x} {y} {a}" for i, (x, y, a) in
                  enumerate([(0, 0, 0), (1, 0, 1.5707963), (1, 1, 3.1415927), (0, 1, -1.5707963)])]
        edges = [f"EDGE_SE2 {i} {i + 1} 1 0 1.5707963 {information}" for i in range(3)]
        path.write_text("\n".join(square + edges + [f"EDGE_SE2 3 0 1.2 0 1.5707963 {information}", ""]))
        shown = self.run_json("info", "square.g2o")
        self.assertEqual((shown["dimensions"], shown["nodes"]), (2, 4))
        self.assertEqual((shown["odometry_edges"], shown["loop_edges"]), (3, 1))
        self.assertAlmostEqual(shown["path_length_m"], 3.0, places=5)
        self.assertAlmostEqual(shown["chi2"], 0.04, places=5)
        self.assertAlmostEqual(shown["largest_loop_chi2"], 0.04, places=5)
        self.assertIn("the plane of 4 nodes", self.run_hm("info", "square.g2o").stdout)
        path.write_text("nothing of the kind\n")
        self.assertIn("no vertex and no edge", self.run_hm("info", "square.g2o", expect=3).stderr)

    def test_info_finds_a_wrong_depth_scale(self):
        self.simulate(frames=60)
        good = self.run_json("info", "recording")
        wrong = self.run_json("info", "recording", "--depth-units-per-m", "50000")
        self.assertGreater(len(wrong["warnings"]), len(good["warnings"]))
        self.assertRegex(" ".join(wrong["warnings"]).lower(), "scale|10|unit")

    def test_simulate_is_reproducible_and_the_seed_matters(self):
        for name, seed in (("a", 3), ("b", 3), ("c", 4)):
            self.run_hm("simulate", "room", "-o", name, "--frames", 3, "--seed", seed, "--quiet")
        pictures = [[path.read_bytes() for path in sorted((self.folder / name / "depth").iterdir())]
                    for name in ("a", "b", "c")]
        self.assertEqual(len(pictures[0]), 3)
        self.assertEqual(pictures[0], pictures[1])
        self.assertNotEqual(pictures[0], pictures[2])
        # A folder that holds a recording is not overwritten.
        self.run_json("simulate", "room", "-o", "a", "--frames", 3, expect=2)

    def test_simulate_corridor_with_drift(self):
        document = self.run_json("simulate", "corridor", "-o", "corridor", "--frames", 20, "--drift")
        self.assertGreater(document["end_drift_m"], 0)
        self.assertTrue((self.folder / "corridor/poses.txt").exists())
        # As an estimate a recording stands for the poses it reports, as truth for the true ones.
        drift = self.run_json("evaluate", "trajectory", "corridor", "corridor", "--set",
                              "trajectory_error.alignment=none")
        self.assertEqual(drift["pairs"], 20)
        self.assertGreater(drift["ate_max_m"], 0.9 * document["end_drift_m"])

    def test_simulate_as_real_recordings_are(self):
        document = self.run_json("simulate", "room", "-o", "real", "--frames", 4, "--realistic", "--seed", 3)
        sizes = document["flaws"]
        self.assertTrue(0.015 <= sizes["readout_s"] <= 0.03 and 1 <= sizes["people"] <= 3, sizes)
        written = (self.folder / "real/flaws.toml").read_text()
        for name in sizes:
            self.assertIn(f"{name} = ", written)
        self.assertTrue((self.folder / "real/poses.txt").exists())
        text = self.run_hm("simulate", "room", "-o", "late", "--frames", 4, "--set", "simulation.flaws=time_offset").stdout
        self.assertIn("color_delay_s", text)
        self.assertNotIn("readout_s", text)
        self.assertEqual(self.run_json("simulate", "room", "-o", "ideal", "--frames", 2)["flaws"], {})
        for words, reason in ((["--set", "simulation.flaws=blur,blurr"], "names 'blurr'; known are blur, rolling_shutter"),
                              (["--set", "simulation.rolling_shutter=true"], "'simulation.flaws'")):
            failed = self.run_json("simulate", "room", "-o", "wrong", "--frames", 2, *words, expect=2)
            self.assertIn(reason, failed["error"]["message"])
            self.assertFalse((self.folder / "wrong").exists())
        self.run_hm("simulate", "room", "-o", "wrong", "--realistic", "--perfect", expect=2)

    def test_demo(self):
        demo = self.run_json("demo", *ROOM)
        self.assertEqual(demo["frames"]["integrated"], 30)
        self.assertLess(demo["surface_error_mm"]["mean"], 20)
        self.assertIn("completeness_ratio", demo)
        text = self.run_hm("demo", *ROOM, "--set", "reconstruction.pictures=false").stdout  # again, over the old one
        for word in ("report.html", "mesh.ply", "map.hmap", "mean error is"):
            self.assertIn(word, text)

    def test_the_truth_of_the_demo_reaches_as_far_as_its_reconstruction(self):
        def truth_points(*more):
            self.run_hm("demo", *ROOM, "--set", "simulation.frame_limit=15", "--set", "tsdf.voxel_size_m=0.05", "--set",
                        "reconstruction.pictures=false", "--quiet", *more)
            return self.run_json("info", "demo/recording/truth_visible.ply")["vertices"]
        near, whole = truth_points("--set", "tsdf.far_m=2"), truth_points()
        self.assertLess(near, 0.9 * whole)
        self.assertEqual(truth_points("--set", "tsdf.far_m=2", "--set", "simulation.truth_far_m=100"), whole)

    def test_demo_deletes_nothing_that_is_not_its_own(self):
        mine = self.folder / "demo/recording"
        mine.mkdir(parents=True)
        (mine / "depth.txt").write_text("# mine\n")
        self.run_hm("demo", *ROOM, expect=2)
        self.assertEqual((mine / "depth.txt").read_text(), "# mine\n")

    def test_params(self):
        shown = self.run_json("params", "show", "--set", "tsdf.voxel_size_m=0.01")["parameters"]
        self.assertEqual(shown["tsdf.voxel_size_m"], "0.01")
        text = self.run_hm("params", "show", "--set", "tsdf.far_m=3.5").stdout
        (self.folder / "a.toml").write_text(text)
        (self.folder / "b.toml").write_text(self.run_hm("params", "show").stdout)
        self.run_hm("params", "check", "a.toml")
        difference = self.run_json("params", "diff", "a.toml", "b.toml")["differences"]
        self.assertEqual(difference, {"tsdf.far_m": {"a": "3.5", "b": "4.0"}})
        self.assertIn("no difference", self.run_hm("params", "diff", "a.toml", "a.toml").stdout)
        explained = self.run_hm("params", "explain", "tsdf.far_m").stdout
        self.assertIn("0.1 to 200", explained)
        self.assertIn("tsdf.voxel_size_m", self.run_hm("params", "explain", "tsdf.voxel_sise_m", expect=2).stderr)

    def test_presets_and_generated_reference(self):
        presets = [path for path in sorted((support.SOURCE / "configs").glob("*.toml"))
                   if not path.stem.endswith("_rig")]  # where a laser sits is no parameter
        self.assertGreaterEqual(len(presets), 3)
        for preset in presets:
            self.run_hm("params", "check", preset)
            if preset.stem != "pelican":  # the vehicle of the defaults
                self.assertNotEqual(self.run_json("params", "show", "--params", preset)["parameters"],
                                    self.run_json("params", "show")["parameters"], preset.name)
        reference = (support.SOURCE / "docs/parameters.md").read_text()
        self.assertTrue(reference.endswith(self.run_hm("params", "show", "--markdown").stdout),
                        "docs/parameters.md is old: see its first lines")

    def test_evaluate_trajectory_closed_form(self):
        truth = [f"{i / 10} {i / 10} {(i % 7) / 10} 0 0 0 0 1" for i in range(100)]
        shifted = [f"{i / 10} {i / 10 + 5} {(i % 7) / 10 - 2} 1 0 0 0 1" for i in range(100)]
        (self.folder / "truth.tum").write_text("\n".join(truth))
        (self.folder / "shifted.tum").write_text("\n".join(shifted))
        aligned = self.run_json("evaluate", "trajectory", "shifted.tum", "truth.tum", "--report", "page.html")
        self.assertLess(aligned["ate_rmse_m"], 1e-9)
        self.assertEqual(aligned["pairs"], 100)
        self.assertIn("<svg", (self.folder / "page.html").read_text())
        raw = self.run_json("evaluate", "trajectory", "shifted.tum", "truth.tum", "--set",
                            "trajectory_error.alignment=none")
        self.assertAlmostEqual(raw["ate_rmse_m"], 30 ** 0.5, places=9)
        self.assertLess(raw["rpe_translation_rmse_m"], 1e-9)

    def test_json_stays_one_object_when_things_go_wrong(self):
        self.simulate(frames=2)
        (self.folder / "recording/rgb.txt").write_text("garbage\n")
        process = self.start("info", "recording", "--json")
        output, _ = process.communicate(timeout=60)
        self.assertIn(process.returncode, (0, 3))
        self.assertIn("ok", json.loads(output))


if __name__ == "__main__":
    support.main()
