"""Where up is: in models of given poses and of poses that were found; what files, JSON and info say of it."""
import json
import math
import shutil
import struct

import support

FAST = ["--set", "reconstruction.pictures=false", "--set", "mesh_error.samples=20000"]
COARSE = ["--voxel", "0.05", *FAST]
HALF, QUARTER = ([*COARSE, "--set", f"reconstruction.frame_stride={stride}"] for stride in (2, 4))  # of the frames
SLAM = [*COARSE, "--set", "slam.matrices=false"]


def multiply(a, b):
    """Product of quaternions (x, y, z, w), as trajectories have them."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)


def conjugate(q):
    return (-q[0], -q[1], -q[2], q[3])


def rotate(q, p):
    return multiply(multiply(q, (*p, 0)), conjugate(q))[:3]


def about(axis, degrees):
    half = math.radians(degrees) / 2
    return (*(math.sin(half) * v for v in axis), math.cos(half))


def angle_deg(a, b):
    dot = sum(u * v for u, v in zip(a, b)) / math.sqrt(sum(u * u for u in a) * sum(v * v for v in b))
    return math.degrees(math.acos(max(-1, min(1, dot))))


def read_poses(path):
    rows = [list(map(float, line.split())) for line in path.read_text().splitlines() if line and line[0] != "#"]
    return [(row[0], tuple(row[1:4]), tuple(row[4:8])) for row in rows]


def write_poses(path, poses):
    path.write_text("".join(f"{t:.9f} " + " ".join(f"{v:.9f}" for v in (*p, *q)) + "\n" for t, p, q in poses))


def turned(poses, q):
    return [(t, rotate(q, p), multiply(q, r)) for t, p, r in poses]


def up_in_truth(estimate, truth, up=(0, 0, 1)):
    """The direction `up` of the estimate's frame in that of the truth, by the orientations of both."""
    total = (0, 0, 0)
    for stamp, _, q in estimate:
        near = min(truth, key=lambda pose: abs(pose[0] - stamp))
        if abs(near[0] - stamp) < 0.02:
            seen = rotate(near[2], rotate(conjugate(q), up))
            total = tuple(a + b for a, b in zip(total, seen))
    return total


def glb_document(path):
    data = path.read_bytes()
    length, = struct.unpack("<I", data[12:16])
    return json.loads(data[20:20 + length])


def ply_header(path):
    return path.read_bytes()[:600].split(b"end_header")[0].decode()


class GivenPoses(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        cls.recording = keeper.simulate("room", 70, "room", "--sensor", "kinect")
        cls.poses = read_poses(cls.recording / "groundtruth.txt")

    def reconstruct(self, turn, name, *more):
        write_poses(self.folder / f"{name}.tum", turned(self.poses, turn))
        return self.run_json("reconstruct", self.recording, "-o", name, "--poses", f"{name}.tum", *QUARTER, *more)

    def test_files_say_where_up_is_in_any_frame(self):
        self.assertEqual(self.reconstruct((0, 0, 0, 1), "plain")["up"]["axis"], "z")
        self.assertIn("comment up z (from ", ply_header(self.folder / "plain/mesh.ply"))
        # y down, as of 7-Scenes and most vision programs; and a frame without any reason.
        for name, turn in (("y_down", about((1, 0, 0), 90)), ("askew", about((0.6, 0, 0.8), 131))):
            with self.subTest(name):
                up = rotate(turn, (0, 0, 1))
                run = self.reconstruct(turn, name)
                self.assertTrue(run["up"]["known"])
                self.assertLess(angle_deg(run["up"]["direction"], up), 1)
                if name == "y_down":
                    self.assertEqual(run["up"]["axis"], "-y")
                self.assertNotIn("z up", ply_header(self.folder / name / "mesh.ply"))
                info = self.run_json("info", f"{name}/mesh.ply")
                self.assertIn("(from ", info["up"])
                self.assertEqual(self.run_json("info", f"{name}/mesh.glb")["up"], info["up"])
                self.assertEqual(self.run_json("info", f"{name}/map.hmap")["up"], info["up"])
                rows = glb_document(self.folder / name / "mesh.glb")["asset"]["extras"]["R_gltf_frame"]
                in_viewer = [sum(rows[3 * i + j] * up[j] for j in range(3)) for i in range(3)]
                self.assertLess(angle_deg(in_viewer, (0, 1, 0)), 1)
                # A GLB comes back into the map's frame.
                boxes = [self.run_json("info", f"{name}/mesh.{ending}")["bounds_m"] for ending in ("ply", "glb")]
                for corner in ("min", "max"):
                    for a, b in zip(boxes[0][corner], boxes[1][corner]):
                        self.assertAlmostEqual(a, b, places=4)

    def test_level_turns_the_poses_first(self):
        turn = about((0.6, 0, 0.8), 131)
        run = self.reconstruct(turn, "levelled", "--level")
        self.assertEqual(run["up"]["axis"], "z")
        self.assertTrue(run["up"]["levelled"])
        poses = read_poses(self.folder / "levelled/trajectory.tum")
        self.assertLess(angle_deg(up_in_truth(poses, self.poses), (0, 0, 1)), 1)
        self.assertEqual(self.run_json("info", "levelled/mesh.ply")["up"].split(" ")[0], "z")
        # Compared with the truth where the truth is: the map did not get worse by being turned.
        plain = self.reconstruct((0, 0, 0, 1), "kept")
        level = self.run_json("reconstruct", self.recording, "-o", "kept_level", "--level", *QUARTER)
        self.assertAlmostEqual(level["surface_error_mm"]["mean"], plain["surface_error_mm"]["mean"], delta=1.0)

    def test_level_goes_on_as_it_began(self):
        write_poses(self.folder / "askew.tum", turned(self.poses, about((0.6, 0, 0.8), 131)))
        words = ["reconstruct", self.recording, "--poses", "askew.tum", "--level", *HALF]
        whole = self.run_json(*words, "-o", "whole")
        part = self.start(*words, "-o", "part", "--json", "--set", "reconstruction.save_interval_frames=5")
        while part.poll() is None and not (self.folder / "part/map.hmap").exists():
            pass
        part.kill()
        part.communicate()
        self.assertTrue((self.folder / "part/map.hmap").exists())
        resumed = self.run_json(*words, "-o", "part", "--resume")
        self.assertEqual(resumed["bounds_m"], whole["bounds_m"])
        self.assertEqual((self.folder / "part/mesh.ply").read_bytes(), (self.folder / "whole/mesh.ply").read_bytes())

    def test_one_view_alone_is_unknown_and_said_so(self):
        run = self.run_json("reconstruct", self.recording, "-o", "far", "--set", "reconstruction.frame_limit=1",
                            "--set", "tsdf.far_m=2", *COARSE)
        self.assertGreater(run["triangles"], 0)
        self.assertFalse(run["up"]["known"])
        self.assertIsNone(run["up"]["direction"])
        self.assertIn("comment up unknown", ply_header(self.folder / "far/mesh.ply"))
        self.assertTrue(any("up is unknown" in warning for warning in run["warnings"]))
        self.assertEqual(glb_document(self.folder / "far/mesh.glb")["asset"]["extras"]["R_gltf_frame"],
                         [1, 0, 0, 0, 1, 0, 0, 0, 1])

    def slam(self, name, *more):
        run = self.run_json("slam", self.recording, "-o", name, *SLAM, *more)
        poses = read_poses(self.folder / name / "trajectory.tum")
        return run, angle_deg(up_in_truth(poses, self.poses), (0, 0, 1))

    def test_slam_levels_what_it_finds(self):
        free = ["--set", "slam.start_at_pose=false"]
        run, off = self.slam("level", *free)
        self.assertTrue(run["up"]["levelled"])
        self.assertEqual(run["up"]["axis"], "z")
        self.assertLess(off, 1)
        self.assertIn("comment up z (from ", ply_header(self.folder / "level/mesh.ply"))
        self.assertTrue(self.run_json("info", "level/map.hmap")["up"].startswith("z (from "))
        first = read_poses(self.folder / "level/trajectory.tum")[0]
        self.assertLess(math.dist(first[1], (0, 0, 0)), 0.02)
        ahead = rotate(first[2], (0, 0, 1))
        self.assertLess(abs(math.degrees(math.atan2(ahead[1], ahead[0]))), 1)
        # The same room as found by a camera that is rolled: turned pictures are not made here, so compare with off.
        _, before = self.slam("as_held", *free, "--set", "slam.level=false")
        self.assertGreater(before, 3)
        # A given frame is kept.
        given, off = self.slam("given")
        self.assertFalse(given["up"]["levelled"])
        self.assertLess(off, 1)

    def test_slam_is_level_without_an_accelerometer_too(self):
        bare = self.folder / "bare"
        shutil.copytree(self.recording, bare)
        for name in ("imu.csv", "imu.toml"):
            (bare / name).unlink(missing_ok=True)
        run = self.run_json("slam", bare, "-o", "without", "--set", "slam.start_at_pose=false", *SLAM)
        self.assertEqual(run["up"]["source"], "floor and walls")
        off = angle_deg(up_in_truth(read_poses(self.folder / "without/trajectory.tum"), self.poses), (0, 0, 1))
        self.assertLess(off, 1)


# Up in the frame of each recording's poses. Of fr1 the motion capture's z is not it: the floor that fr1/rpy sees, the
# desk, and gravity by its accelerometer with the bias taken out agree on this direction within half a degree. Of
# 7-Scenes the plane of the floor, fitted to a mesh by hand; ICL-NUIM is y up by definition.
# Recording -> (up, frame stride).
REAL = {
    "rgbd/tum_fr1_xyz": ((0.0145, -0.0365, 0.9992), 4),
    "rgbd/tum_fr1_rpy": ((0.0145, -0.0365, 0.9992), 4),
    "rgbd/sevenscenes_a": ((0.0081, -0.8891, -0.4577), 12),
    "rgbd/icl_of_kt3": ((0, 1, 0), 4),
}


class RealRecordings(support.ProgramTest):
    def setUp(self):
        super().setUp()
        if not support.real_data():
            self.skipTest("no real recordings in $HM_DATA or ../shared/data")

    def test_up_in_given_frames(self):
        for name, (up, stride) in REAL.items():
            with self.subTest(name):
                folder = name.replace("/", "_")
                run = self.run_json("reconstruct", support.real_data() / name, "-o", folder, "--voxel", "0.03", *FAST, "--set",
                                    f"reconstruction.frame_stride={stride}")
                self.assertTrue(run["up"]["known"])
                self.assertLess(angle_deg(run["up"]["direction"], up), 1)

    def test_slam_of_a_desk_is_level(self):
        recording = support.real_data() / "rgbd/tum_fr1_xyz"
        truth = read_poses(recording / "groundtruth.txt")
        words = [*SLAM, "--set", "slam.start_at_pose=false", "--set", "reconstruction.frame_limit=60"]
        bare = self.folder / "bare"
        shutil.copytree(recording, bare, ignore=shutil.ignore_patterns("accelerometer.txt"))
        for name, folder, source in (("with", recording, "gravity"), ("without", bare, "floor and walls")):
            with self.subTest(name):
                run = self.run_json("slam", folder, "-o", name, *words)
                self.assertIn(source, run["up"]["source"])
                up = up_in_truth(read_poses(self.folder / name / "trajectory.tum"), truth)
                self.assertLess(angle_deg(up, REAL["rgbd/tum_fr1_xyz"][0]), 1)

    def test_slam_of_fast_turns_is_level(self):
        recording = support.real_data() / "rgbd/tum_fr1_rpy"
        run = self.run_json("slam", recording, "-o", "turns", *SLAM, "--set", "slam.start_at_pose=false")
        self.assertEqual(run["up"]["source"], "gravity, floor and walls")
        up = up_in_truth(read_poses(self.folder / "turns/trajectory.tum"), read_poses(recording / "groundtruth.txt"))
        self.assertLess(angle_deg(up, REAL["rgbd/tum_fr1_rpy"][0]), 1)


if __name__ == "__main__":
    support.main()
