"""hm slam --resume: killed or stopped anywhere, the run continues, and the result is that of one left alone."""
import json
import signal
import time

import support

FRAMES = 90
FAST = ["--voxel", "0.06", "--set", "reconstruction.pictures=false", "--set", "slam.matrices=false", "--set",
        "mesh_error.samples=20000"]
SAVING = ["--set", "reconstruction.save_interval_frames=4"]
RESULTS = ("trajectory.tum", "odometry.tum", "keyframes.tum", "graph.g2o", "mesh.ply")


def wait_for_states(process, path, count):
    """Returns when the state has changed `count` times on disk, or the process has ended."""
    seen, last = 0, None
    while seen < count and process.poll() is None:
        try:
            status = path.stat()
            now = (status.st_mtime_ns, status.st_ino)
        except FileNotFoundError:
            now = None
        seen += now is not None and now != last
        last = now
        time.sleep(0.002)


class SlamResume(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        keeper.simulate("room", FRAMES, "room", "--sensor", "kinect")
        keeper.run_hm("slam", keeper.folder / "room", "-o", "whole", "--quiet", *FAST)
        SlamResume.recording = keeper.folder / "room"
        SlamResume.whole = keeper.folder / "whole"
        SlamResume.whole_run = json.loads((SlamResume.whole / "report.json").read_text())

    def assert_equal_to_whole(self, name, run):
        for file in RESULTS:
            self.assertEqual((self.folder / name / file).read_bytes(), (self.whole / file).read_bytes(), file)
        for key in ("keyframes", "frames_mapped", "volumes"):
            self.assertEqual(run[key], self.whole_run[key], key)
        self.assertEqual(run["loops"]["accepted"], self.whole_run["loops"]["accepted"])
        self.assertEqual(run["frames"], self.whole_run["frames"])

    def kill_after(self, name, saves, number=signal.SIGKILL):
        process = self.start("slam", self.recording, "-o", name, "--resume", "--json", "--quiet", *FAST, *SAVING)
        self.addCleanup(process.kill)
        wait_for_states(process, self.folder / name / "slam_state.bin", saves)
        process.send_signal(number)
        return process.communicate(timeout=300)

    def test_killed_again_and_again(self):
        resumed_at = []
        for saves in (2, 3, 2):
            self.kill_after("killed", saves)
            resumed_at.append(json.loads(self.kill_after("killed", 2, signal.SIGINT)[0] or "{}").get("resumed_at_frame"))
        run = self.run_json("slam", self.recording, "-o", "killed", "--resume", *FAST)
        self.assertGreater(run["resumed_at_frame"], 0)
        resumed_at = [frame for frame in resumed_at if frame is not None] + [run["resumed_at_frame"]]
        self.assertEqual(resumed_at, sorted(resumed_at), "no run begins before the one before it")
        self.assert_equal_to_whole("killed", run)
        self.assertIn("resumed at frame", (self.folder / "killed/report.html").read_text())
        again = self.run_json("slam", self.recording, "-o", "killed", "--resume", *FAST)
        self.assertTrue(again["complete"])

    def test_stopped_then_resumed(self):
        output, errors = self.kill_after("stopped", 3, signal.SIGINT)
        first = json.loads(output)
        self.assertTrue(first["interrupted"], errors)
        run = self.run_json("slam", self.recording, "-o", "stopped", "--resume", *FAST)
        self.assertEqual(run["resumed_at_frame"], first["frames"]["read"], "where it was stopped, not at the last save")
        self.assert_equal_to_whole("stopped", run)

    def test_what_cannot_be_continued_is_refused_in_words(self):
        self.kill_after("part", 3)
        state, journal = (self.folder / "part" / name for name in ("slam_state.bin", "slam_journal.bin"))
        good_state, good_journal = state.read_bytes(), journal.read_bytes()

        def refused(*more, recording=self.recording, expect=3):
            text = self.run_hm("slam", recording, "-o", "part", "--resume", *FAST, *more, expect=expect).stderr
            self.assertIn("--overwrite", text)
            return text

        for damaged in (good_state[:-1], good_state[:300], b"", good_state[:500] + b"\x99" + good_state[501:]):
            state.write_bytes(damaged)
            self.assertIn("slam_state.bin", refused())
        next_version = good_state[8] + 1
        state.write_bytes(good_state[:8] + bytes([next_version]) + good_state[9:])
        self.assertIn(f"version {next_version}", refused())
        state.write_bytes(good_state)
        journal.write_bytes(good_journal[:2000])
        self.assertIn("slam_journal.bin", refused())
        journal.write_bytes(good_journal[:3000] + b"\x99\x98" + good_journal[3002:])
        self.assertIn("slam_journal.bin", refused())
        journal.write_bytes(good_journal)
        self.assertIn("odometry.max_depth_m", refused("--set", "odometry.max_depth_m=3", expect=2))
        self.simulate("other", 12, "corridor", "--sensor", "kinect")
        text = self.run_hm("slam", "other", "-o", "part", "--resume", *FAST, expect=2).stderr
        self.assertIn("another recording", text)
        # None of this has harmed the state.
        run = self.run_json("slam", self.recording, "-o", "part", "--resume", *FAST)
        self.assertGreater(run["resumed_at_frame"], 0)
        self.assert_equal_to_whole("part", run)

    def test_what_cannot_be_saved_is_repeated(self):
        words = ["slam", self.recording, "-o", "published", *FAST, *SAVING, "--set", "odometry.method=frame_to_frame",
                 "--set", "reconstruction.frame_limit=40"]
        process = self.start(*words, "--quiet")
        self.addCleanup(process.kill)
        wait_for_states(process, self.folder / "published/map.hmap", 2)
        process.kill()
        process.communicate()
        self.assertFalse((self.folder / "published/slam_state.bin").exists())
        done = self.run_hm(*words, "--resume", "--json")
        self.assertNotIn("resumed_at_frame", json.loads(done.stdout))
        self.assertIn("repeated from the first frame", done.stderr)


if __name__ == "__main__":
    support.main()
