"""The verdict of a run: good results are ok, bent ones are not; --strict; console, JSON and report agree."""
import math

import support


def quaternion_product(a, b):
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)


def turned(row, angle_rad, shift_m):
    """A TUM row turned about the z axis of the world, and moved along x."""
    stamp, x, y, z, *rotation = (float(word) for word in row.split())
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    rotation = quaternion_product((0, 0, math.sin(angle_rad / 2), math.cos(angle_rad / 2)), rotation)
    return " ".join(map(repr, (stamp, c * x - s * y + shift_m, s * x + c * y, z, *rotation)))


FEWER = ("--set", "reconstruction.frame_stride=2")


class Verdict(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        keeper.run_hm("simulate", "room", "-o", "room", "--quiet")
        Verdict.room, Verdict.bent = keeper.folder / "room", keeper.folder
        rows = [row for row in (Verdict.room / "groundtruth.txt").read_text().splitlines() if not row.startswith("#")]
        half = len(rows) // 2
        for name, angle_rad, shift_m in (("twist", 0.14, 0), ("shift", 0, 0.25)):
            bent = rows[:half] + [turned(row, angle_rad, shift_m) for row in rows[half:]]
            (keeper.folder / f"{name}.txt").write_text("\n".join(bent) + "\n")

    def test_true_poses_are_ok_and_strict_passes(self):
        run = self.run_json("reconstruct", self.room, "-o", "good", "--strict", *FEWER)
        self.assertEqual(run["verdict"]["value"], "ok", run["verdict"])
        self.assertEqual(run["verdict"]["reasons"], [])
        self.assertGreater(run["verdict"]["visits"]["places"], 9)

    def bent_run(self, name, *words, expect):
        run = self.run_json("reconstruct", self.room, "-o", name, "--poses", self.bent / f"{name}.txt", *FEWER, *words,
                            expect=expect)
        self.assertIn(run["verdict"]["value"], ("doubtful", "broken"), run["verdict"])
        self.assertIn("free space", run["verdict"]["reasons"][0])
        word = run["verdict"]["value"].capitalize()
        self.assertIn(f"{word}: around", (self.folder / name / "report.html").read_text())
        return run

    def test_a_shift_is_not_presented_as_right(self):
        self.bent_run("shift", expect=0)

    def test_a_twist_is_not_presented_as_right_and_strict_fails_with_the_reason(self):
        run = self.bent_run("twist", "--strict", expect=1)
        self.assertIn("the verdict is", run["error"]["message"])
        self.assertTrue((self.folder / "twist" / "mesh.ply").exists())


if __name__ == "__main__":
    support.main()
