"""Every verb measures a trajectory alike; several trajectories at once; errors that would mislead are marked."""
import json
import math
import re
import shutil

import support

PLAIN = ("--set", "reconstruction.pictures=false", "--set", "slam.matrices=false", "--set", "tsdf.voxel_size_m=0.06", "--set",
         "mesh_error.samples=20000")
KEYS = ("ate_rmse_m", "rpe_frame_m", "rpe_second_m", "rpe_second_rad", "rpe_metre_m", "truth_path_m")


def poses_of(path):
    return [[float(word) for word in line.split()] for line in path.read_text().splitlines() if line and line[0] != "#"]


def write(path, poses):
    path.write_text("".join(" ".join([f"{p[0]:.9f}", *map(repr, p[1:])]) + "\n" for p in poses))


def between(a, b, share):
    return [u + share * (v - u) for u, v in zip(a, b)]


def at_other_stamps(poses, later_s):
    """The same path with two poses between any two, none at the stamp of an old one."""
    finer = []
    for a, b in zip(poses, poses[1:]):
        for share in (0, 0.5):
            pose = between(a, b, share + later_s / (b[0] - a[0]))
            norm = math.sqrt(sum(v * v for v in pose[4:]))
            finer.append(pose[:4] + [v / norm for v in pose[4:]])
    return finer


class SameNumbers(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        keeper.simulate("recording", 30)
        other = shutil.copytree(keeper.folder / "recording", keeper.folder / "other_stamps")
        write(other / "groundtruth.txt", at_other_stamps(poses_of(other / "groundtruth.txt"), 0.007))

    def check_verbs(self, recording, *more):
        for verb in ("odometry", "slam"):
            result = f"{verb}_{recording.name}"
            run = self.keeper.run_json(verb, recording, "-o", result, *PLAIN, *more)
            for truth in (recording, recording / "groundtruth.txt"):
                with self.subTest(verb=verb, truth=truth.name):
                    self.check_same(run, result + "/trajectory.tum", truth)
            if verb == "slam":
                self.check_same(run["odometry"], result + "/odometry.tum", recording)

    def check_same(self, run, trajectory, truth):
        measured = self.keeper.run_json("evaluate", "trajectory", trajectory, truth)
        keys = [key for key in KEYS if key in run]
        self.assertGreaterEqual(len(keys), 3, run.keys())
        self.assertEqual({key: run[key] for key in keys}, {key: measured[key] for key in keys})

    def test_odometry_slam_and_evaluate_agree_to_the_last_digit(self):
        self.check_verbs(self.keeper.folder / "recording")

    def test_they_agree_where_the_truth_has_other_stamps(self):
        self.check_verbs(self.keeper.folder / "other_stamps")

    def test_the_truth_is_interpolated(self):
        folder = self.keeper.folder
        fine = self.keeper.run_json("evaluate", "trajectory", folder / "recording", folder / "other_stamps")
        self.assertGreaterEqual(fine["pairs"], 28)
        self.assertLess(fine["ate_rmse_m"], 0.003)
        nearest = self.keeper.run_json("evaluate", "trajectory", folder / "recording", folder / "other_stamps",
                                       "--set", "trajectory_error.association=nearest")
        self.assertGreater(nearest["ate_given_rmse_m"], fine["ate_given_rmse_m"])

    def test_real_recording(self):
        data = support.real_data()
        if not data:
            self.skipTest("no real recordings in $HM_DATA or ../shared/data")
        self.check_verbs(data / "rgbd/tum_fr1_xyz", "--set", "reconstruction.frame_limit=60")


class Several(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        keeper.simulate("recording", 30)
        keeper.run_hm("odometry", "recording", "-o", "a", "--quiet")
        keeper.run_hm("slam", "recording", "-o", "b", "--quiet", *PLAIN)

    def test_a_table_of_all_with_and_without_alignment(self):
        words = ("a/trajectory.tum", "b/trajectory.tum", "b/odometry.tum")
        run = self.keeper.run_json("evaluate", "trajectory", *words, "recording")
        rows = run["trajectories"]
        self.assertEqual([row["name"] for row in rows], list(words))
        for row, path in zip(rows, words):
            one = self.keeper.run_json("evaluate", "trajectory", path, "recording")
            self.assertEqual({key: one[key] for key in KEYS}, {key: row[key] for key in KEYS})
            given = self.keeper.run_json("evaluate", "trajectory", path, "recording", "--alignment", "none")
            for name in ("mean", "median", "rmse", "max"):
                self.assertAlmostEqual(row[f"ate_given_{name}_m"], given[f"ate_{name}_m"], delta=1e-12)
                self.assertLess(row[f"ate_{name}_m"], 0.2)
        self.assertGreater(rows[0]["ate_given_rmse_m"], 0.5)  # odometry begins at the origin of its own frame
        text = self.keeper.run_hm("evaluate", "trajectory", *words, "recording").stdout
        for path, row in zip(words, rows):
            line = next(line for line in text.splitlines() if line.startswith(path))
            numbers = [f"{row[f'ate_{kind}{name}_m']:.4f}" for kind in ("", "given_") for name in ("mean", "median", "rmse", "max")]
            self.assertEqual(line.split()[1:], [str(row["pairs"]), *numbers])

    def test_one_figure_has_all_paths(self):
        self.keeper.run_hm("evaluate", "trajectory", "a/trajectory.tum", "b/trajectory.tum", "recording", "--report", "page.html")
        page = (self.keeper.folder / "page.html").read_text()
        figure = next(svg for svg in re.findall(r"<svg.*?</figure>", page, re.S) if "From above" in svg)
        for name in ("truth", "a", "b"):  # not the file name that they share
            self.assertIn(f">{name}<", figure)
        for words in ("Position error without alignment", "RMSE", "median", "largest"):
            self.assertIn(words, page)

    def test_mistakes(self):
        self.keeper.run_hm("evaluate", "trajectory", "a/trajectory.tum", expect=2)
        failed = self.keeper.run_json("evaluate", "trajectory", "a/trajectory.tum", "missing.tum", "recording", expect=3)
        self.assertEqual(failed["error"]["where"], "missing.tum")


class OneSource(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        keeper.simulate("recording", 20)
        keeper.run_hm("odometry", "recording", "-o", "tracked", "--quiet")
        few = ("--quiet", *PLAIN)
        keeper.run_hm("reconstruct", "recording", "-o", "built", *few)
        keeper.run_hm("reconstruct", "recording", "-o", "aligned", *few, "--align")
        keeper.run_hm("reconstruct", "recording", "-o", "own", *few, "--align", "--poses", "tracked/trajectory.tum")

    def warnings(self, *words):
        return self.keeper.run_json("evaluate", "trajectory", *words)["warnings"]

    def test_the_same_poses(self):
        for estimate in ("built/trajectory.tum", "recording", "recording/groundtruth.txt"):
            for truth in ("recording", "recording/groundtruth.txt"):
                with self.subTest(estimate=estimate, truth=truth):
                    said = self.warnings(estimate, truth)
                    self.assertEqual(len(said), 1, said)
                    self.assertIn(f"{estimate} has the poses of the truth", said[0])

    def test_a_result_that_was_built_with_them(self):
        for truth in ("recording", "recording/groundtruth.txt"):
            said = self.warnings("aligned/trajectory.tum", truth)
            self.assertEqual(len(said), 1, said)
            self.assertIn("aligned/trajectory.tum was built with the poses that are now the truth", said[0])
        self.keeper.run_hm("evaluate", "trajectory", "aligned/trajectory.tum", "recording", "--report", "page.html")
        self.assertIn("built with the poses", (self.keeper.folder / "page.html").read_text())

    def test_an_estimate_of_its_own(self):
        self.assertEqual(self.warnings("tracked/trajectory.tum", "recording"), [])
        self.assertEqual(self.warnings("own/trajectory.tum", "recording"), [])
        said = self.warnings("tracked/trajectory.tum", "built/trajectory.tum", "recording")
        self.assertEqual(len(said), 1, said)
        self.assertIn("built/trajectory.tum", said[0])


class Misleading(support.ProgramTest):
    def straight(self, wide_m):
        """A path of 2 m, and an estimate that is off by 2 mm: nearly straight when it is not wide."""
        truth, estimate = [], []
        for i in range(100):
            t = 0.05 * i
            p = [0.4 * t, wide_m * math.cos(t), wide_m * math.sin(t)]
            truth.append([t, *p, 0.0, 0.0, 0.0, 1.0])
            turn = 0.001 * math.sin(7 * t)
            off = [v + 0.002 * math.sin(5 * t + k) for k, v in enumerate(p)]
            estimate.append([t, *off, math.sin(turn / 2), 0.0, 0.0, math.cos(turn / 2)])
        write(self.folder / "truth.tum", truth)
        write(self.folder / "estimate.tum", estimate)
        return truth, estimate

    def test_an_undetermined_orientation_is_not_reported_as_an_error(self):
        self.straight(0.0005)
        run = self.run_json("evaluate", "trajectory", "estimate.tum", "truth.tum", "--report", "page.html")
        self.assertIsNone(run["rotation_rmse_rad"])
        self.assertTrue(run["rotation_undetermined"])
        self.assertGreater(run["alignment_uncertainty_rad"], 0.1)
        self.assertLess(run["rotation_own_rmse_rad"], 0.001)
        text = self.run_hm("evaluate", "trajectory", "estimate.tum", "truth.tum").stdout
        self.assertIn("orientation             undetermined", text)
        self.assertIn("the error of the orientation after it is undetermined",
                      (self.folder / "page.html").read_text())

    def test_a_wide_path_has_one(self):
        self.straight(1)
        run = self.run_json("evaluate", "trajectory", "estimate.tum", "truth.tum", "--report", "page.html")
        self.assertFalse(run["rotation_undetermined"])
        self.assertLess(run["rotation_rmse_rad"], 0.004)
        self.assertNotIn("undetermined", (self.folder / "page.html").read_text())

    def test_motion_that_is_not_physical_is_marked_in_an_evaluation(self):
        _, estimate = self.straight(1)
        self.run_hm("evaluate", "trajectory", "estimate.tum", "truth.tum", "--report", "calm.html")
        self.assertNotIn("not physical", (self.folder / "calm.html").read_text())
        estimate[50][0] = estimate[49][0] + 0.0005  # 2 cm in half a millisecond
        write(self.folder / "estimate.tum", estimate)
        self.run_hm("evaluate", "trajectory", "estimate.tum", "truth.tum", "--report", "page.html")
        page = (self.folder / "page.html").read_text()
        self.assertIn("1 not physical", page)
        self.assertIn("1 value lies beyond 30 m/s", page)

    def test_motion_that_is_not_physical_is_marked_in_odometry_and_slam(self):
        recording = self.simulate("recording", 20)
        stamps = [line.split()[0] for line in (recording / "depth.txt").read_text().splitlines() if line[0] != "#"]
        wrong = f"{float(stamps[9]) + 0.0005:.9f}"
        for name in ("depth.txt", "rgb.txt", "associations.txt"):
            text = (recording / name).read_text()
            (recording / name).write_text(re.sub(rf"(^|\s){stamps[10]}(?=\s)", rf"\g<1>{wrong}", text))
        for verb in ("odometry", "slam"):
            with self.subTest(verb):
                run = self.run_json(verb, "recording", "-o", verb, "--set", "odometry.use_imu=off", *PLAIN)
                self.assertEqual(run["frames"]["tracked"], 20)
                page = (self.folder / verb / "report.html").read_text()
                self.assertRegex(page, r"\d not physical")
                self.assertRegex(page, r"beyond 30 m/s, up to \d+")


if __name__ == "__main__":
    support.main()
