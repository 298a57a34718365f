"""hm slam --continue: a recording goes on in a saved map, or the map is said not to be recognised."""
import json
import shutil

import support

FAST = ["--voxel", "0.06", "--set", "reconstruction.pictures=false", "--set", "slam.matrices=false", "--set",
        "mesh_error.samples=20000"]
FIRST = ["--set", "reconstruction.frame_limit=60"]
SECOND = ["--set", "reconstruction.begin_frame=45"]


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


class SlamContinue(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        keeper.simulate("room", 90, "room", "--sensor", "kinect")
        keeper.simulate("corridor", 40, "corridor", "--sensor", "kinect")
        keeper.run_hm("slam", keeper.folder / "room", "-o", "first", "--quiet", *FAST, *FIRST)
        SlamContinue.room, SlamContinue.corridor = keeper.folder / "room", keeper.folder / "corridor"
        SlamContinue.first = keeper.folder / "first"
        before = contents(cls.first)
        SlamContinue.run_of_both = keeper.run_json("slam", cls.room, "-o", "both", "--continue", cls.first, *FAST, *SECOND)
        SlamContinue.both = keeper.folder / "both"
        SlamContinue.first_is_kept = contents(cls.first) == before

    def refused(self, *words, expect):
        done = self.run_hm("slam", *words, "-o", "refused", *FAST, expect=expect)
        self.assertFalse((self.folder / "refused" / "trajectory.tum").exists())
        return done.stderr

    def test_found(self):
        run = self.run_of_both
        self.assertTrue(self.first_is_kept, "the saved map stays as it is")
        continued = run["continued"]
        self.assertEqual(continued["from"], str(self.first))
        self.assertGreater(continued["loops"], 1)
        self.assertGreaterEqual(continued["best_score"], continued["score_needed"])
        self.assertGreaterEqual(continued["recognised_at_s"], 0)
        self.assertEqual(run["frames"]["read"], 45, "of the new recording")
        first = json.loads((self.first / "report.json").read_text())
        self.assertGreater(run["frames_mapped"], first["frames_mapped"], "the map is that of both")
        self.assertLess(run["ate_rmse_m"], 0.05)
        again = self.run_json("slam", self.room, "-o", "third", "--continue", self.both, *FAST, *SECOND)
        self.assertEqual(again["continued"]["earlier_keyframes"], continued["earlier_keyframes"] + run["keyframes"])
        text = self.run_hm("slam", self.room, "-o", "fresh", "--resume", "--continue", self.first, expect=2).stderr
        self.assertIn("resume", text)

    def test_frame_is_that_of_the_saved_map(self):
        """The frames that both runs have are at the same poses, though the second one began elsewhere."""
        def poses(folder):
            rows = [[float(word) for word in line.split()] for line in (folder / "trajectory.tum").read_text().splitlines()
                    if not line.startswith("#")]
            return {round(row[0], 4): row[1:4] for row in rows}
        old, new = poses(self.first), poses(self.both)
        shared = sorted(set(old) & set(new))
        self.assertGreater(len(shared), 5)
        for stamp in shared:
            self.assertLess(max(abs(a - b) for a, b in zip(old[stamp], new[stamp])), 0.05, stamp)

    def test_another_building_is_not_found(self):
        text = self.refused(self.corridor, "--continue", self.first, expect=1)
        self.assertIn("was not recognised", text)
        self.assertRegex(text, r"at best \d+ feature|not one of its keyframes")

    def test_another_version_or_damage_is_said(self):
        copy = self.folder / "copy"
        shutil.copytree(self.first, copy)
        state = (copy / "slam_state.bin").read_bytes()
        (copy / "slam_state.bin").write_bytes(state[:8] + b"\x02" + state[9:])
        self.assertIn("version 2", self.refused(self.room, "--continue", copy, expect=3))
        (copy / "slam_state.bin").write_bytes(state[:700] + bytes([state[700] ^ 1]) + state[701:])
        self.assertIn("damaged", self.refused(self.room, "--continue", copy, expect=3))
        (copy / "slam_state.bin").unlink()
        self.assertIn("slam_state.bin", self.refused(self.room, "--continue", copy, expect=3))
        no_loops = self.refused(self.room, "--continue", self.first, "--set", "rgbd_loops.enabled=false", expect=2)
        self.assertIn("rgbd_loops.enabled: ", no_loops)
        self.assertIn("another folder", self.run_hm("slam", self.room, "-o", self.first, "--overwrite", "--continue",
                                                    self.first, expect=2).stderr)


if __name__ == "__main__":
    support.main()
