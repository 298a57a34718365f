"""The usual mistakes of a first hour: each gets the right exit code, its cause, its place and its remedy, and loses
nothing."""
import re
import shutil
import sqlite3
import unittest

import support

FAST = ["--voxel", "0.05", "--set", "reconstruction.pictures=false", "--set", "mesh_error.samples=20000"]
OF_VERB = {"reconstruct": FAST, "slam": [*FAST, "--set", "slam.matrices=false"]}
TOO_LONG_AGO = "1000000000."


def quaternion_inverse_line(line):
    """A line `stamp tx ty tz qx qy qz qw` with the inverse pose."""
    stamp, *numbers = line.split()
    x, y, z, qx, qy, qz, qw = map(float, numbers)
    qx, qy, qz = -qx, -qy, -qz
    # -R^T t, by the quaternion's rotation.
    ux, uy, uz = (2 * (qy * z - qz * y), 2 * (qz * x - qx * z), 2 * (qx * y - qy * x))
    turned = (x + qw * ux + qy * uz - qz * uy, y + qw * uy + qz * ux - qx * uz, z + qw * uz + qx * uy - qy * ux)
    return " ".join([stamp, *(f"{-value:.9f}" for value in turned), *(f"{q:.9f}" for q in (qx, qy, qz, qw))])


class UsualMistakes(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        cls.recording = keeper.simulate("recording", 40, "room", "--sensor", "kinect", "--set",
                                        "simulation.frame_stride=3")
        keeper.run_hm("reconstruct", "recording", "-o", "result", *FAST, "--quiet")
        cls.result = keeper.folder / "result"

    def copy(self, name="copy"):
        shutil.copytree(self.recording, self.folder / name)
        return self.folder / name

    def refused(self, *words, expect=3, says=()):
        error = self.run_json(*words, expect=expect)["error"]
        for text in says:
            self.assertIn(text, error["message"] + " " + error.get("where", ""))
        return error

    # ---- a recording that is read wrongly ----
    def test_wrong_depth_unit(self):
        for verb in ("reconstruct", "slam", "odometry"):
            self.refused(verb, self.recording, "-o", "out", "--depth-units-per-m", "50000",
                         says=["units per metre", "--force", "hm info"])
            self.assertFalse((self.folder / "out").exists())

    def test_forced_all_the_same(self):
        run = self.run_json("reconstruct", self.recording, "-o", "out", "--depth-units-per-m", "50000", "--force",
                            *FAST)
        self.assertTrue(any("units per metre" in warning for warning in run["warnings"]), run["warnings"])
        self.assertNotEqual(run["verdict"]["value"], "ok")
        self.assertTrue(any("units per metre" in reason for reason in run["verdict"]["reasons"]), run["verdict"])

    def test_depth_unit_of_millimetres_without_poses(self):
        copy = self.copy()
        (copy / "groundtruth.txt").unlink()
        (copy / "poses.txt").unlink(missing_ok=True)
        self.refused("odometry", copy, "-o", "out", "--depth-units-per-m", "500",  # ten times too far: tracks nothing
                     says=["not one of 40 frames got a pose", "look at the depth scale"])
        warnings = self.run_json("info", copy, "--depth-units-per-m", "900")["warnings"]
        self.assertTrue(any("look at the depth scale" in warning for warning in warnings), warnings)
        for verb in ("odometry", "slam"):
            self.refused(verb, copy, "-o", verb, "--depth-units-per-m", "100000", "--strict", *OF_VERB.get(verb, []),
                         expect=1, says=["doubtful: the depth scale may be wrong"])
        self.refused("info", copy, "--depth-units-per-m", "0.001", expect=2, says=["write 1000 (units per metre)"])

    def test_inverted_poses(self):
        copy = self.copy()
        lines = [line for line in (copy / "groundtruth.txt").read_text().splitlines() if not line.startswith("#")]
        (copy / "groundtruth.txt").write_text("\n".join(map(quaternion_inverse_line, lines)) + "\n")
        self.refused("reconstruct", copy, "-o", "out", says=["world-to-camera"])
        run = self.run_json("odometry", copy, "-o", "tracked")  # finds its own
        self.assertTrue(any("world-to-camera" in warning for warning in run["warnings"]), run["warnings"])

    def test_inverted_poses_given_by_file(self):
        lines = [line for line in (self.recording / "groundtruth.txt").read_text().splitlines() if line[0] != "#"]
        (self.folder / "poses.tum").write_text("\n".join(map(quaternion_inverse_line, lines)) + "\n")
        self.refused("reconstruct", self.recording, "--poses", "poses.tum", "-o", "out", says=["world-to-camera"])

    def test_sign_of_fy(self):
        camera = dict(line.split()[:2] for line in (self.recording / "camera.txt").read_text().splitlines()
                      if line.strip() and not line.startswith("#"))
        self.refused("reconstruct", self.recording, "-o", "out", "--intrinsics", camera["fx"], f"-{camera['fy']}",
                     camera["cx"], camera["cy"], "--size", camera["width"], camera["height"], says=["fy seems to be"])

    def test_no_colour(self):
        copy = self.copy()
        (copy / "rgb.txt").unlink()
        for verb in ("odometry", "slam"):
            run = self.run_json(verb, copy, "-o", verb, *OF_VERB.get(verb, []))
            self.assertTrue(any("no colour images" in warning for warning in run["warnings"]), run["warnings"])
            self.assertTrue(any("by depth alone" in warning for warning in run["warnings"]), run["warnings"])
            self.assertEqual(run["frames"]["by_depth"], run["frames"]["tracked"])
        self.refused("odometry", copy, "-o", "out", "--method", "published_icp", says=["no colour images"])
        self.assertTrue(any("no colour" in warning for warning in self.run_json("info", copy)["warnings"]))
        self.run_json("reconstruct", copy, "-o", "out", *FAST)

    def test_no_poses(self):
        copy = self.copy()
        (copy / "groundtruth.txt").unlink()
        (copy / "poses.txt").unlink(missing_ok=True)
        self.refused("reconstruct", copy, "-o", "out", says=["hm slam", "--poses", "no poses"])
        self.assertEqual(self.run_json("info", copy)["warnings"], [])

    def test_poses_that_cannot_be_read(self):
        copy = self.copy()
        (copy / "poses.txt").unlink(missing_ok=True)
        rows = [line.split() for line in (copy / "groundtruth.txt").read_text().splitlines() if line[0] != "#"]
        (copy / "groundtruth.txt").write_text("".join(" ".join(row[:4]) + "\n" for row in rows))
        says = "groundtruth.txt:1: 4 columns: positions without orientations"
        for words in (["info", copy], ["odometry", copy, "-o", "odometry"]):
            warnings = self.run_json(*words)["warnings"]
            self.assertTrue(any(says in warning for warning in warnings), warnings)
        self.refused("reconstruct", copy, "-o", "out", says=[says, "--poses"])
        self.refused("evaluate", "trajectory", "odometry/trajectory.tum", copy, says=[says])
        (copy / "groundtruth.txt").write_text("timestamp,tx,ty,tz,qx,qy,qz,qw\n" +
                                              "".join(",".join(row) + "\n" for row in rows))
        self.assertEqual(self.run_json("info", copy)["frames_with_pose"],
                         self.run_json("info", self.recording)["frames_with_pose"])

    def test_quaternions_with_the_real_part_first(self):
        copy = self.copy()
        rows = [line.split() for line in (copy / "groundtruth.txt").read_text().splitlines() if line[0] != "#"]
        (copy / "groundtruth.txt").write_text("".join(" ".join([*row[:4], row[7], *row[4:7]]) + "\n" for row in rows))
        self.refused("reconstruct", copy, "-o", "out", says=["qw qx qy qz instead of qx qy qz qw"])

    def test_poses_of_another_clock(self):
        copy = self.copy()
        poses = [line.split(" ", 1) for line in (copy / "groundtruth.txt").read_text().splitlines() if line[0] != "#"]
        (copy / "groundtruth.txt").write_text("".join(f"{float(stamp) + 1e6:.9f} {pose}\n" for stamp, pose in poses))
        error = self.refused("reconstruct", copy, "-o", "out", says=["no common clock", "0.15 s", "--poses"])
        self.assertNotIn("no poses", error["message"])
        self.refused("reconstruct", self.recording, "--poses", copy / "groundtruth.txt", "-o", "out",
                     says=["poses (given)", "no common clock"])

    def test_clocks_that_disagree(self):
        copy = self.copy()
        lines = (copy / "rgb.txt").read_text().splitlines()
        (copy / "rgb.txt").write_text("\n".join(line if line.startswith("#") else TOO_LONG_AGO + line.split(".", 1)[1]
                                                for line in lines) + "\n")
        run = self.run_json("info", copy)
        self.assertTrue(any("without a colour image" in warning for warning in run["warnings"]), run["warnings"])

    def test_a_hole_in_the_stream_is_a_warning_of_every_verb(self):
        copy = self.copy()
        lines = (copy / "depth.txt").read_text().splitlines()
        (copy / "depth.txt").write_text("\n".join(lines[:12] + lines[28:]) + "\n")
        for verb in ("reconstruct", "odometry"):
            run = self.run_json(verb, copy, "-o", verb, *OF_VERB.get(verb, []))
            self.assertTrue(any(re.search("gaps?, the longest", warning) for warning in run["warnings"]), run["warnings"])
            self.assertRegex((self.folder / verb / "report.html").read_text(), "gaps?, the longest")

    # ---- not a recording, or not the right place ----
    def test_other_formats_are_named_with_the_way_from_there(self):
        formats = {"Stray Scanner": ["rgb.mp4", "odometry.csv", "camera_matrix.csv"],
                   "Polycam": ["keyframes/images/1.jpg", "mesh_info.json"],
                   "3D Scanner App": ["info.json", "frame_00000.json", "frame_00000.jpg"],
                   "Record3D": ["rgbd/0.jpg", "metadata.json"],
                   "ROS 2 bag": ["metadata.yaml", "bag_0.db3"]}
        for name, files in formats.items():
            folder = self.folder / name.replace(" ", "_")
            for file in files:
                (folder / file).parent.mkdir(parents=True, exist_ok=True)
                (folder / file).write_bytes(b"x")
            for verb in ("info", "slam"):
                words = [verb, folder] + (["-o", "out"] if verb != "info" else [])
                with self.subTest(name, verb=verb):
                    self.refused(*words, says=[name])

    def test_other_files_are_named(self):
        sqlite3.connect(self.folder / "map.db").execute("create table Node (id integer)").connection.commit()
        for name, says in {"flat.mp4": "a video", "flat.zip": "unpack it", "flat.tar.gz": "unpack it",
                           "scan.r3d": "Record3D", "0.mcap": "ROS 2 bag", "cloud.pcd": "point cloud",
                           "map.db": "rtabmap-export"}.items():
            if name != "map.db":
                (self.folder / name).write_bytes(b"something")
            with self.subTest(name):
                self.refused("info", name, says=[says])
                self.refused("slam", name, "-o", "out", says=[says])

    def test_the_folder_above_and_the_folder_below(self):
        self.copy("a/first"), self.copy("a/second")
        self.refused("info", "a", says=["2 recordings inside: first, second"])
        self.refused("reconstruct", "a/first/depth", "-o", "out", says=["the folder above is a recording", "a/first"])

    def test_images_without_lists_are_read_by_their_names(self):
        copy = self.copy()
        for name in ("depth.txt", "rgb.txt", "associations.txt"):
            (copy / name).unlink(missing_ok=True)
        scale = dict(line.split()[:2] for line in (copy / "camera.txt").read_text().splitlines()
                     if line and line[0] != "#")["depth_scale"]
        report = self.run_json("info", copy, "--depth-units-per-m", scale)
        self.assertIn("no depth.txt", str(report))
        named = self.run_json("odometry", copy, "-o", "named", "--depth-units-per-m", scale)
        listed = self.run_json("odometry", self.recording, "-o", "listed")
        self.assertEqual(named["frames"], listed["frames"])
        self.assertEqual(named["ate_rmse_m"], listed["ate_rmse_m"])

    def test_a_folder_of_results(self):
        report = self.run_json("info", self.result)
        self.assertEqual((report["path_kind"], report["result_of"], report["state"]), ("result", "reconstruct", "complete"))
        self.assertGreater(report["report"]["triangles"], 1000)
        self.assertIn("mesh.ply", [file["name"] for file in report["files"]])
        self.refused("slam", self.result, "-o", "out", says=["folder of results"])
        self.refused("convert", self.result, "x.obj", expect=2, says=["name the file"])

    def test_a_path_that_is_not_there(self):
        self.refused("reconstruct", "nowhere", "-o", "out", says=["no such folder", "nowhere"])

    # ---- words that are wrong ----
    def test_words_typed_wrongly(self):
        for words, meant in ((["recontruct", "x"], "reconstruct"), (["evaluate", "trajectry", "a", "b"], "trajectory"),
                             (["reconstruct", "x", "--voxle", "0.1"], "--voxel"), (["slam", "x", "--outptu", "y"], "--output"),
                             (["params", "show", "--set", "voxel=0.1"], "tsdf.voxel_size_m"),
                             (["params", "show", "--set", "tsdf.voxel_sise_m=0.1"], "tsdf.voxel_size_m"),
                             (["params", "show", "--set", "slam.voxel_size=0.1"], "tsdf.voxel_size_m")):
            result = self.run_hm(*words, expect=2)
            self.assertIn(f"did you mean '{meant}'?", result.stderr)

    def test_every_verb_refuses_a_parameter_that_is_not(self):
        mesh, path = self.result / "mesh.ply", self.result / "trajectory.tum"
        for words in (["info", self.recording], ["info", mesh], ["info", self.result], ["reconstruct", self.recording, "-o", "out"],
                      ["slam", self.recording, "-o", "out"], ["odometry", self.recording, "-o", "out"], ["laser", "x.log", "-o", "out"],
                      ["convert", mesh, "x.obj"], ["evaluate", "trajectory", path, path], ["evaluate", "mesh", mesh, mesh],
                      ["simulate", "room", "-o", "out"], ["fly", "hover", "-o", "out"], ["demo", "-o", "out"], ["serve", self.result],
                      ["experiment", "list"], ["scan", "--camera", f"replay:{self.recording}", "-o", "out"]):
            self.refused(*words, "--set", "no.such=1", expect=2, says=["unknown parameter 'no.such'"])

    def test_nothing_near_proposes_nothing(self):
        self.assertNotIn("did you mean", self.run_hm("xyzzyplugh", expect=2).stderr)
        self.assertIn("hm params show", self.run_hm("params", "show", "--set", "qqqq.zzzzzz=1", expect=2).stderr)

    # ---- results ----
    def test_a_finished_run_is_not_repeated(self):
        shutil.copytree(self.result, self.folder / "result")
        before = {path.name: path.read_bytes() for path in (self.folder / "result").iterdir() if path.is_file()}
        run = self.run_json("reconstruct", self.recording, "-o", "result", "--resume")
        self.assertTrue(run["complete"])
        after = {path.name: path.read_bytes() for path in (self.folder / "result").iterdir() if path.is_file()}
        self.assertEqual(before, after)

    def test_another_run_on_a_result(self):
        shutil.copytree(self.result, self.folder / "result")
        other = self.simulate("other", 6)
        for words in (["reconstruct", other], ["odometry", self.recording], ["slam", self.recording]):
            self.refused(*words, "-o", "result", expect=2, says=["holds the result of `hm reconstruct`", "--overwrite"])


if __name__ == "__main__":
    unittest.main()
