"""The verdict of a run: good results are ok, bent ones are not; --strict; console, JSON and report agree."""
import support
from bent_poses import bent, read_rows, rotated


PLAIN = ("--set", "reconstruction.pictures=false", "--set", "mesh_error.samples=20000")
FEWER = ("--voxel", "0.03", "--set", "reconstruction.frame_stride=2", *PLAIN)


class Verdict(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        keeper.run_hm("simulate", "room", "-o", "room", "--quiet")
        Verdict.room, Verdict.bent = keeper.folder / "room", keeper.folder
        rows = read_rows(Verdict.room / "groundtruth.txt")
        for name, bend in (("twist", {"turn_deg": 8}), ("shift", {"shift_m": 0.25, "axis": (1, 0, 0)})):
            (keeper.folder / f"{name}.txt").write_text(bent(rows, 0.5, **bend))

    def test_true_poses_are_ok_and_strict_passes(self):
        run = self.run_json("reconstruct", self.room, "-o", "good", "--strict", *FEWER)
        self.assertEqual(run["verdict"]["value"], "ok", run["verdict"])
        self.assertEqual(run["verdict"]["reasons"], [])
        self.assertGreater(run["verdict"]["visits"]["places"], 9)
        self.assertLess(run["verdict"]["visits"]["worst_offset_ratio"], 0.01)

    def bent_run(self, name, *words, expect):
        run = self.run_json("reconstruct", self.room, "-o", name, "--poses", self.bent / f"{name}.txt", *FEWER, *words,
                            expect=expect)
        self.assertIn(run["verdict"]["value"], ("doubtful", "broken"), run["verdict"])
        reasons = " ".join(run["verdict"]["reasons"])
        self.assertIn("free space", reasons)
        self.assertIn("depth images differ by", reasons)
        self.assertGreater(run["verdict"]["visits"]["worst_offset_ratio"], 0.03)
        word = run["verdict"]["value"].capitalize()
        self.assertIn(f"{word}: around", (self.folder / name / "report.html").read_text())
        return run

    def test_a_shift_is_not_presented_as_right(self):
        self.bent_run("shift", expect=0)

    def test_a_twist_is_not_presented_as_right_and_strict_fails_with_the_reason(self):
        run = self.bent_run("twist", "--strict", expect=1)
        self.assertIn("the verdict is", run["error"]["message"])
        self.assertTrue((self.folder / "twist" / "mesh.ply").exists())
        again = self.run_json("reconstruct", self.room, "-o", "twist", "--poses", self.bent / "twist.txt", *FEWER, "--resume",
                              "--strict", expect=1)
        self.assertEqual(again["error"]["message"], run["error"]["message"])

    def test_a_jump_shows_where_no_place_is_seen_twice(self):
        short, _ = support.simulated("room", "--set", "simulation.frame_limit=25")
        rows = read_rows(short / "groundtruth.txt")
        ahead = rotated(rows[12][4:8], (0, 0, 1))
        for name, bend, limit in (("still", {}, 0), ("roll", {"turn_deg": 6, "axis": ahead}, 1), ("twist", {"turn_deg": 8}, 1), ("shift", {"shift_m": 0.25, "axis": (0, 1, 0)}, 1)):
            (self.folder / "poses.txt").write_text(bent(rows, 0.5, **bend))
            run = self.run_json("reconstruct", short, "-o", name, "--poses", self.folder / "poses.txt", *PLAIN)
            verdict = run["verdict"]
            self.assertEqual(verdict["visits"]["places"], 0, "nothing else can show it")
            self.assertEqual(verdict["steps"]["compared"], 24)
            self.assertEqual(len(verdict["reasons"]), limit, verdict)
            if limit:
                self.assertIn("the path jumps", verdict["reasons"][0])
                if name == "roll":
                    self.assertAlmostEqual(verdict["steps"]["color_rad"], 0.105, delta=0.03)
                    self.assertIn("colour moved by", verdict["reasons"][0])
                self.assertAlmostEqual(verdict["steps"]["worst_time_s"], rows[12][0] - rows[0][0], delta=0.01)
            else:
                self.assertLess(verdict["steps"]["tilt_rad"], 0.03)


if __name__ == "__main__":
    support.main()
