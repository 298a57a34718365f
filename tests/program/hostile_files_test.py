"""Files that someone made to harm: bombs, deep headers, links in the way, numbers that no camera has."""
import bz2
import math
import struct
import time

import support


def record(fields, data):
    """A record of a ROS bag."""
    header = b"".join(struct.pack("<I", len(key) + 1 + len(value)) + key + b"=" + value for key, value in fields)
    return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data


def bomb(chunks, size):
    """A bag of bz2 chunks of so many zeros each."""
    head = [(b"op", b"\x03"), (b"index_pos", bytes(8)), (b"conn_count", bytes(4)), (b"chunk_count", bytes(4))]
    packed = bz2.compress(bytes(size))
    chunk = record([(b"op", b"\x05"), (b"compression", b"bz2"), (b"size", struct.pack("<I", size))], packed)
    return b"#ROSBAG V2.0\n" + record(head, b"") + chunks * chunk


class HostileFiles(support.ProgramTest):
    def refused(self, *words, expect=3):
        return self.run_json(*words, expect=expect)["error"]["message"]

    def test_bombs_cost_neither_memory_nor_time(self):
        for chunks, size in ((1, 300_000_000), (20, 50_000_000), (400, 15_000_000)):
            (self.folder / "bomb.bag").write_bytes(bomb(chunks, size))
            begun = time.monotonic()
            text = self.refused("info", "bomb.bag")
            self.assertIn("allowed", text)
            self.assertLess(time.monotonic() - begun, 20)

    def test_a_recordings_own_calibration_cannot_overflow_the_stack(self):
        recording = self.simulate(frames=2)
        (recording / "calibration.toml").write_text("[a" + 40_000 * ".a" + "]\n")
        for verb in (["info", recording], ["reconstruct", recording, "-o", "out"]):
            self.assertIn("nested too deeply", self.refused(*verb))
        text = self.run_hm("reconstruct", recording, "-o", "out", "--params", recording / "calibration.toml",
                           expect=2).stderr
        self.assertIn("nested too deeply", text)

    def test_a_camera_that_cannot_be_is_refused_with_its_number(self):
        recording = self.simulate(frames=2)
        camera = recording / "camera.txt"
        lines = camera.read_text().splitlines()
        camera.write_text("\n".join("fx 1e300" if line.startswith("fx ") else line for line in lines) + "\n")
        self.assertIn("fx = 1e+300", self.refused("reconstruct", recording, "-o", "out"))

    def test_meshes_of_others_are_read_or_refused(self):
        corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
        stl = bytes(80) + struct.pack("<I", 1) + struct.pack("<12fH", 0, 0, 1, *sum(corners, ()), 0)
        (self.folder / "a.stl").write_bytes(stl)
        (self.folder / "a.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
        measured = self.run_json("evaluate", "mesh", "a.stl", "a.off")
        self.assertLess(measured["accuracy_mm"]["mean"], 1e-3)
        self.assertEqual(self.run_json("info", "a.stl")["vertices"], 3)
        self.run_hm("convert", "a.stl", "a.ply")
        (self.folder / "cut.stl").write_bytes(stl[:90])
        (self.folder / "deep.dae").write_text("<COLLADA>" + 100_000 * "<a>")
        (self.folder / "none.fbx").write_text("; FBX")
        for name in ("cut.stl", "deep.dae", "none.fbx"):
            self.assertIn(name, str(self.run_json("evaluate", "mesh", name, "a.off", expect=3)["error"]))
        self.assertIn(".stl", self.refused("evaluate", "mesh", "a.xyz", "a.off"))

    def test_links_in_a_folder_of_results_are_not_followed(self):
        recording = self.simulate(frames=6)
        victim, elsewhere = self.folder / "victim", self.folder / "elsewhere"
        victim.write_text("precious")
        elsewhere.mkdir()
        for name, target in ((".partial", elsewhere), ("pictures", elsewhere)):
            out = self.folder / f"out_{name}"
            out.mkdir()
            (out / name).symlink_to(target)
            result = self.start("reconstruct", recording, "-o", out, "--quiet", "--voxel", "0.05", "--set", "mesh_error.samples=20000",
                                "--set", f"reconstruction.pictures={'true' if name == 'pictures' else 'false'}")
            _, errors = result.communicate(timeout=300)
            if result.returncode == 0:
                self.assertFalse((out / name).is_symlink(), name)
            else:
                self.assertIn(name, errors)
        self.assertEqual(victim.read_text(), "precious")
        self.assertEqual(list(elsewhere.iterdir()), [])

    def test_a_place_beyond_octomap_costs_map_bt_only(self):
        ranges = " ".join(f"{3 + 0.3 * math.sin(0.1 * i):.3f}" for i in range(180))
        scans = [(100, 0.0), (101, 0.1), (102, 0.2), (103, 99_999.8), (104, 99_999.9), (105, 100_000.0)]
        log = "".join(f"ODOM {x} 0 0 0 0 0 {t}.0 h 1\nFLASER 180 {ranges} {x} 0 0 {x} 0 0 {t}.0 h 1\n"
                      for t, x in scans)
        (self.folder / "far.log").write_text("# CARMEN Logfile\nPARAM front_laser_max 50\n" + log)
        run = self.run_json("laser", "far.log", "-o", "out", "--set", "laser.poses=odometry", "--set", "laser.pictures=false")
        self.assertTrue(any(warning.startswith("no map.bt: the voxel at (") for warning in run["warnings"]),
                        run["warnings"])
        self.assertFalse((self.folder / "out/map.bt").exists())
        for name in ("map.mvog", "map.ply", "trajectory.tum", "report.json", "report.html"):
            self.assertGreater((self.folder / "out" / name).stat().st_size, 20, name)

    def test_a_folder_named_like_a_camera_is_no_recording_of_it(self):
        recording = self.simulate("my_fr2024", frames=2)
        (recording / "camera.txt").unlink()
        self.assertIn("intrinsics are not known", self.refused("info", recording))
        recording.rename(self.folder / "tum_fr2_desk")
        self.assertIn("TUM's camera of `tum_fr2_desk`", self.refused("info", "tum_fr2_desk"))  # and not of its size


if __name__ == "__main__":
    support.main()
