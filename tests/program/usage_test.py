"""Exit codes and sentences: what a user sees who typed something wrong or has a broken file."""
import unittest

import support

VERBS = ["demo", "info", "simulate", "reconstruct", "odometry", "slam", "fly hover", "fly script", "evaluate trajectory", "evaluate mesh",
         "evaluate uncertainty", "evaluate depth-compensation", "convert",
         "params show", "params check", "params explain", "params diff"]


class Usage(support.ProgramTest):
    def test_help(self):
        overview = self.run_hm("--help").stdout
        self.assertEqual(overview, self.run_hm().stdout)
        for verb in VERBS:
            text = self.run_hm(*verb.split(), "--help").stdout
            self.assertIn("Examples:", text, verb)
            self.assertIn("--json", text, verb)
            self.assertIn(verb.split()[0], overview)

    def test_version(self):
        self.assertRegex(self.run_hm("--version").stdout, r"^housemartin \d+\.\d+\.\d+")

    def test_wrong_words_are_usage_errors(self):
        for words in (["fly_away"], ["info"], ["reconstruct"], ["evaluate"], ["info", "a", "--frobnicate"],
                      ["simulate", "castle"], ["info", "a", "--threads", "0"], ["info", "a", "--threads", "many"],
                      ["reconstruct", "a", "--voxel", "-1"], ["reconstruct", "a", "--kind", "video"]):
            result = self.run_hm(*words, expect=2)
            self.assertEqual(result.stdout, "")
            self.assertIn("hm: ", result.stderr)
            self.assertIn("--help", result.stderr)

    def test_an_address_apart_from_serve(self):
        for words in (["demo", "--serve", "127.0.0.1:8080"], ["reconstruct", "x", "--serve", "8080", "-o", "y"],
                      ["laser", "--serve", "0.0.0.0", "x"], ["slam", "x", "--serve", "[::1]:80"], ["demo", "--serve", "localhost"]):
            address = words[words.index("--serve") + 1]
            self.assertIn(f"--serve={address}", self.run_hm(*words, expect=2).stderr)
        document = self.run_json("demo", "--serve", "127.0.0.1:8080", expect=2)
        self.assertIn("--serve=127.0.0.1:8080", document["error"]["message"])
        # What is no address stays the next argument, and so does a recording that has the name of one.
        self.assertNotIn("'='", self.run_hm("reconstruct", "--serve", "nowhere", expect=3).stderr)
        (self.folder / "8080").mkdir()
        self.assertNotIn("'='", self.run_hm("reconstruct", "--serve", "8080", expect=3).stderr)

    def test_wrong_words_with_json(self):
        document = self.run_json("info", "a", "--frobnicate", expect=2)
        self.assertIn("frobnicate", document["error"]["message"])
        self.assertEqual(document["error"]["code"], "usage")

    def test_unknown_parameter_names_the_nearest(self):
        for words in (["params", "show"], ["reconstruct", "nowhere"], ["simulate", "room"]):
            result = self.run_hm(*words, "--set", "tsdf.voxel_sise_m=0.01", expect=2)
            self.assertIn("tsdf.voxel_size_m", result.stderr)

    def test_parameter_out_of_range(self):
        result = self.run_hm("params", "show", "--set", "tsdf.voxel_size_m=17", expect=2)
        self.assertIn("0.002 to 0.5", result.stderr)
        result = self.run_hm("params", "show", "--set", "tsdf.voxel_size_m=wide", expect=2)
        self.assertIn("number", result.stderr)

    def test_contradicting_parameters(self):
        self.simulate(frames=2)
        result = self.run_hm("reconstruct", "recording", "--set", "tsdf.near_m=3", "--set", "tsdf.far_m=2", expect=2)
        self.assertIn("near", result.stderr)
        result = self.run_hm("reconstruct", "recording", "--set", "reconstruction.mesh_formats=ply,stl", expect=2)
        self.assertIn("stl", result.stderr)

    def test_every_wrong_line_of_a_parameter_file_is_named(self):
        (self.folder / "bad.toml").write_text("[tsdf]\nvoxel_size_m = 9\nfar = 3\n\n[mesh]\nsimplify_keep_ratio = 'x'\n")
        for words in (["params", "check", "bad.toml"], ["params", "show", "--params", "bad.toml"],
                      ["reconstruct", "nowhere", "--params", "bad.toml"]):
            text = self.run_hm(*words, expect=2).stderr
            for part in ("bad.toml", "line 2", "line 3", "line 6", "far_m"):
                self.assertIn(part, text)
        self.assertIn("nothing.toml", self.run_hm("params", "check", "nothing.toml", expect=2).stderr)

    def test_missing_and_foreign_inputs(self):
        (self.folder / "empty").mkdir()
        (self.folder / "notes.xyz").write_text("hello")
        for words in (["info", "nowhere"], ["info", "empty"], ["info", "notes.xyz"], ["reconstruct", "nowhere"],
                      ["reconstruct", "empty"], ["convert", "nowhere", "b.ply"],
                      ["evaluate", "mesh", "nowhere.ply", "empty"],
                      ["evaluate", "trajectory", "nowhere.tum", "empty"]):
            result = self.run_hm(*words, expect=3)
            self.assertRegex(result.stderr, "nowhere|empty|notes", words)
            self.assertEqual(self.run_json(*words, expect=3)["outputs"], [])

    def test_damaged_files_are_named_with_the_place(self):
        files = {"bad.ply": b"ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
                            b"property float z\nend_header\n1 2 3\n", "bad.glb": b"glTF\x02\0\0\0\xff\0\0\0",
                 "bad.obj": b"v 1 2 three\n", "bad.hmap": b"SQLite format 3\0 but not really", "bad.tum": b"1 2 3\n",
                 "empty.hmap": b"", "empty.ply": b"", "empty.tum": b""}
        for name, contents in files.items():
            (self.folder / name).write_bytes(contents)
            result = self.run_hm("info", name, expect=3)
            self.assertIn(name, result.stderr)

    def test_output_folder_that_cannot_be_made(self):
        self.simulate(frames=2)
        (self.folder / "file").write_text("")
        result = self.run_hm("reconstruct", "recording", "-o", "file/result", expect=2)
        self.assertIn("file/result", result.stderr)
        result = self.run_hm("simulate", "room", "-o", "file/recording", "--frames", 2, expect=2)
        self.assertIn("file/recording", result.stderr)

    def test_output_file_that_cannot_be_written_fails_the_run(self):
        self.simulate(frames=4)
        for words in (["convert", "recording/truth_mesh.ply", "no/mesh.obj"],
                      ["convert", "recording/groundtruth.txt", "no/poses.kitti"],
                      ["evaluate", "trajectory", "recording", "recording", "--report", "no/page.html"]):
            self.assertIn(words[-1], self.run_hm(*words, expect=1).stderr)

    def test_conversions_that_make_no_sense(self):
        self.simulate(frames=2)
        self.run_hm("convert", "recording/truth_mesh.ply", "A.OBJ")  # upper case makes sense
        for to in ("a.ply", "b.tum"):
            self.run_hm("convert", "recording", to, expect=2)
        self.run_hm("convert", "recording/truth_mesh.ply", "a.stl", expect=2)


if __name__ == "__main__":
    support.main()
