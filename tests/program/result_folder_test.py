"""Folders of results: refused, replaced, locked, saved while a run goes on, whole on a full disk, reported on a full pipe."""
import json
import os
import resource
import shutil
import signal
import subprocess
import time
import unittest

import support
from resume_test import wait_for_saves

FAST = ["--voxel", "0.05", "--set", "reconstruction.pictures=false", "--set", "mesh_error.samples=20000"]
LIVE = [*FAST, "--set", "slam.matrices=false", "--set", "reconstruction.save_interval_frames=5"]


def files_of(folder):
    """Name -> bytes of every file below a folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


class ResultFolder(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        cls.recording = keeper.simulate(frames=30)
        cls.other = keeper.simulate("other", 12, "corridor")
        keeper.run_hm("reconstruct", "recording", "-o", "result", "--quiet", *FAST)
        cls.result = keeper.folder / "result"
        cls.kinect = keeper.simulate("kinect", 40, "room", "--sensor", "kinect")

    def result_copy(self):
        shutil.copytree(type(self).result, self.folder / "result")
        return self.folder / "result"

    def test_a_result_is_refused_without_overwrite(self):
        result = self.result_copy()
        before = files_of(result)
        for words in (["reconstruct", self.recording], ["reconstruct", self.other], ["slam", self.recording],
                      ["odometry", self.recording], ["laser", self.recording]):
            text = self.run_hm(*words, "-o", "result", expect=2).stderr
            self.assertIn("holds the result of `hm reconstruct`", text)
            self.assertIn("--overwrite", text)
        self.assertEqual(files_of(result), before)
        (result / "run.json").unlink()  # made by an earlier version
        self.assertIn("report.json", self.run_hm("odometry", self.recording, "-o", "result", expect=2).stderr)

    def test_an_unreadable_recording_leaves_the_old_result_whole(self):
        result = self.result_copy()
        before = files_of(result)
        self.run_hm("reconstruct", "nowhere", "-o", "result", "--overwrite", expect=3)
        dark = self.folder / "dark"
        shutil.copytree(self.other, dark)
        for picture in (dark / "depth").iterdir():
            picture.write_bytes(b"no picture")
        text = self.run_hm("reconstruct", "dark", "-o", "result", "--overwrite", expect=3).stderr
        self.assertIn("not one of 12 frames", text)
        self.assertEqual(files_of(result), before)
        self.run_hm("reconstruct", "nowhere", "-o", "a/b/fresh", expect=3)
        self.assertFalse((self.folder / "a").exists())

    def test_overwrite_leaves_nothing_of_the_old_result(self):
        result = self.result_copy()
        (result / "notes.txt").write_text("mine")
        run = self.run_json("odometry", self.kinect, "-o", "result", "--overwrite")
        names = set(files_of(result))
        self.assertEqual(names, {"trajectory.tum", "parameters.toml", "report.json", "report.html", "run.json",
                                 "notes.txt"})
        record = json.loads((result / "run.json").read_text())
        self.assertEqual((record["verb"], record["state"]), ("odometry", "complete"))
        self.assertEqual(record["recording"], str(self.kinect.resolve()))
        self.assertEqual({f"result/{name}" for name in record["files"]}, set(run["outputs"]))

    def test_killed_while_it_replaces(self):
        result = self.result_copy()
        before = files_of(result)
        process = self.start("reconstruct", self.recording, "-o", "result", "--overwrite", "--quiet", "--voxel", "0.04",
                             *LIVE[2:])
        wait_for_saves(process, result / "map.hmap", 2)
        process.kill()
        process.communicate()
        self.assertEqual(self.run_json("info", "result/map.hmap")["problems"], [])
        now = files_of(result)
        if now["map.hmap"] == before["map.hmap"]:
            self.assertEqual(now["mesh.ply"], before["mesh.ply"])
        else:
            self.assertNotEqual(now.get("mesh.ply"), before["mesh.ply"], "an old mesh beside a new map")
        self.run_json("reconstruct", self.recording, "-o", "result", "--resume")
        for name in (".partial", "run.json.partial"):  # the kill may have come while the record was written
            self.assertFalse((result / name).exists(), name)

    def test_resume_of_another_verb_is_refused_in_words(self):
        self.run_json("odometry", self.kinect, "-o", "result")
        for verb in ("reconstruct", "slam"):
            text = self.run_hm(verb, self.recording, "-o", "result", "--resume", expect=2).stderr
            self.assertIn("holds the result of `hm odometry`", text)
            self.assertIn(f"`hm {verb} --resume` cannot continue", text)

    def test_two_runs_into_one_folder(self):
        first = self.start("reconstruct", self.recording, "-o", "shared", "--json", "--quiet", *FAST)
        while not (self.folder / "shared/.partial").exists() and first.poll() is None:
            time.sleep(0.001)
        first.send_signal(signal.SIGSTOP)
        self.addCleanup(first.kill)
        try:
            text = self.run_hm("slam", self.recording, "-o", "shared", expect=2).stderr
            self.assertIn("another run writes into this folder", text)
            self.run_hm("reconstruct", self.recording, "-o", "shared", "--overwrite", expect=2)
        finally:
            first.send_signal(signal.SIGCONT)
        output, errors = first.communicate(timeout=200)
        self.assertEqual(first.returncode, 0, errors)
        self.assertTrue(json.loads(output)["ok"])

    def test_killed_slam_leaves_a_whole_map_and_can_be_repeated(self):
        whole = self.run_json("slam", self.kinect, "-o", "whole", *LIVE)
        process = self.start("slam", self.kinect, "-o", "killed", "--quiet", *LIVE)
        wait_for_saves(process, self.folder / "killed/map.hmap", 0)
        time.sleep(0.05)
        process.kill()
        process.communicate()
        killed = self.folder / "killed"
        self.assertEqual(json.loads((killed / "run.json").read_text())["state"], "running")
        shown = self.run_json("info", "killed/map.hmap")
        self.assertEqual(shown["problems"], [])
        self.assertGreater(shown["volumes"], 10)
        poses = self.run_json("info", "killed/trajectory.tum")["poses"]
        self.assertLess(poses, 40)
        self.assertGreater(poses, 0)
        again = self.run_json("slam", self.kinect, "-o", "killed", "--resume")  # with its parameters
        self.assertEqual(again["frames"], whole["frames"])
        for name in ("trajectory.tum", "mesh.ply", "graph.g2o"):
            self.assertEqual((killed / name).read_bytes(), (self.folder / "whole" / name).read_bytes(), name)
        complete = self.run_json("slam", self.kinect, "-o", "killed", "--resume")
        self.assertTrue(complete["complete"])
        self.assertEqual(complete["run_s"], again["run_s"])  # nothing was run
        self.assertIn("already complete", self.run_hm("slam", self.kinect, "-o", "killed", "--resume").stdout)
        text = self.run_hm("slam", self.other, "-o", "killed", "--resume", expect=2).stderr
        self.assertIn("another recording (of 40 frames", text)

    def test_slam_on_a_full_disk_leaves_no_map_that_looks_whole(self):
        def small_files():
            resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        process = self.start("slam", self.kinect, "-o", "full", "--json", *FAST, preexec_fn=small_files)
        output, errors = process.communicate(timeout=300)
        self.assertEqual(process.returncode, 1, errors)
        self.assertFalse(json.loads(output)["ok"])
        self.assertFalse((self.folder / "full/map.hmap").exists())


class LeftOut(support.ProgramTest):
    def test_what_a_reader_left_out_is_a_warning_of_every_verb(self):
        recording = self.simulate("recording", 16, "room", "--sensor", "kinect")
        (recording / "associations.txt").unlink()
        lines = (recording / "depth.txt").read_text().splitlines()
        body = [line for line in lines if not line.startswith("#")]
        jumped = [line for line in lines if line.startswith("#")] + body[4:] + body[:4]
        (recording / "depth.txt").write_text("\n".join(jumped) + "\n")
        sentence = "4 lines of depth.txt left out: stamps that run backwards or repeat"
        for words in (["reconstruct", "recording", *FAST], ["odometry", "recording"], ["slam", "recording", *LIVE],
                      ["convert", "recording", "converted"],
                      ["evaluate", "trajectory", "recording", "recording"]):
            run = self.run_json(*words)
            self.assertEqual(sum(sentence in warning for warning in run["warnings"]), 1, (words, run["warnings"]))
        text = self.run_hm("odometry", "recording", "-o", "again").stderr
        self.assertIn("warning: " + sentence, text)

    def test_a_bag_that_was_cut(self):
        self.simulate("flight", 200, "room", "--sensor", "laser_mav")
        bag = next((self.folder / "flight").glob("*.bag"))
        contents = bag.read_bytes()
        (self.folder / "cut").mkdir()
        (self.folder / "cut/cut.bag").write_bytes(contents[: len(contents) * 2 // 3])
        run = self.run_json("laser", "cut/cut.bag", "-o", "result", "--set", "laser.pictures=false")
        self.assertTrue(any("no index" in warning or "cut" in warning for warning in run["warnings"]),
                        run["warnings"])
        self.assertEqual(len(run["warnings"]), len(set(run["warnings"])))


class Failures(support.ProgramTest):
    @unittest.skipUnless(os.path.exists("/dev/full"), "no /dev/full")
    def test_a_full_standard_output(self):
        for words in (["params", "show"], ["params", "show", "--json"], ["--help"], ["--version"],
                      ["info", "nowhere", "--json"]):
            with open("/dev/full", "w") as full:
                result = subprocess.run([support.PROGRAM, *words], stdout=full, stderr=subprocess.PIPE, text=True)
            self.assertEqual(result.returncode, 1, (words, result.stderr))
            self.assertIn("standard output", result.stderr)
        with open("/dev/full", "w") as full:  # nowhere to complain
            result = subprocess.run([support.PROGRAM, "info", "nowhere"], stdout=full, stderr=full)
        self.assertIn(result.returncode, (1, 3))

    def test_a_parameter_file_without_end(self):
        document = self.run_json("params", "show", "--params", "/dev/zero", expect=2)
        self.assertIn("not a parameter file", document["error"]["message"])
        self.run_hm("params", "check", "/dev/zero", expect=2)

    def check_memory_limits(self, words, mebibytes):
        """Runs a verb under each limit: it ends well or with an error about what it did not get, memory or (in Embree's words) a thread,
        whose stack is memory, too; never by a signal."""
        failed = 0
        for limit in mebibytes:
            def limited(size=limit << 20):
                resource.setrlimit(resource.RLIMIT_AS, (size, size))
            if subprocess.run([support.PROGRAM, "params", "show"], capture_output=True,
                              preexec_fn=limited).returncode != 0:
                break  # its libraries need more
            output_folder = self.folder / f"out_{words[0]}_{limit}"
            words_here = [str(output_folder) if word == "OUT" else word for word in words]
            process = self.start(*words_here, "--json", "--quiet", preexec_fn=limited)
            output, errors = process.communicate(timeout=200)
            self.assertIn(process.returncode, (0, 1), (words, limit, errors))
            if process.returncode == 1:
                failed += 1
                self.assertFalse(json.loads(output)["ok"])
                self.assertRegex(json.loads(output)["error"]["message"].lower(), "memory|embree.*(thread|pthread_create)",
                                 (words, limit))
                self.check_saved_map(output_folder)
        self.assertGreater(failed, 0, f"no limit was reached by {words}")

    def check_saved_map(self, output_folder):
        """A map that a failed run saved is whole and can be read and meshed; nothing half-written stands beside it."""
        saved = output_folder / "map.hmap"
        if saved.exists():
            self.maps_checked += 1
            shown = self.run_json("info", saved)
            self.assertEqual(shown["problems"], [], saved)
            self.assertGreater(shown["volumes"], 0)
            mesh = output_folder / "again.ply"
            self.assertGreater(self.run_json("convert", saved, mesh)["items"], 0)
            if (output_folder / "mesh.ply").exists():
                self.assertEqual(self.run_json("info", output_folder / "mesh.ply")["problems"], [])

    def test_memory_that_runs_out_is_an_error(self):
        self.simulate(frames=20)
        self.maps_checked = 0
        reconstruct = ["reconstruct", "recording", "-o", "OUT", "--threads", "1", "--voxel", "0.005", *FAST[2:]]
        self.check_memory_limits([*reconstruct, "--set", "reconstruction.save_interval_frames=2"],
                                 (700, 550, 500, 450, 425, 400, 375, 350, 325, 300, 250, 200))
        self.assertGreater(self.maps_checked, 0, "no run had saved anything before its memory ran out")

    def test_memory_that_runs_out_for_search_trees(self):
        self.simulate(frames=8)
        limits = (*range(400, 150, -10), 150)
        self.maps_checked = 0
        self.check_memory_limits(["simulate", "room", "-o", "OUT", "--frames", "3"], limits)
        self.check_memory_limits(["demo", "-o", "OUT"], limits[8::4])
        truth = self.folder / "recording/truth_mesh.ply"
        self.check_memory_limits(["evaluate", "mesh", str(truth), str(truth)], limits[::2])


if __name__ == "__main__":
    support.main()
