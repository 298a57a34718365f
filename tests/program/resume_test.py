"""Killed, stopped, resumed: the result is that of a run that nobody disturbed, bit for bit."""
import json
import shutil
import signal
import sqlite3
import time

import support

FRAMES = 60
FAST = ["--set", "reconstruction.pictures=false", "--set", "reconstruction.save_interval_frames=3", "--set",
        "mesh_error.samples=20000"]


def wait_for_saves(process, path, count):
    """Returns when the map has changed `count` times on disk, or the process has ended."""
    seen, last = 0, None
    while seen <= count and process.poll() is None:
        try:
            state = path.stat()
            now = (state.st_mtime_ns, state.st_size)
        except FileNotFoundError:
            now = None
        seen += now != last
        last = now
        time.sleep(0.0005)


class Resume(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        keeper.simulate(frames=FRAMES)
        cls.whole = keeper.run_json("reconstruct", "recording", "-o", "whole", *FAST)

    def setUp(self):
        super().setUp()
        (self.folder / "recording").symlink_to(self.keeper.folder / "recording")
        shutil.copytree(self.keeper.folder / "whole", self.folder / "whole")

    def assert_equal_to_whole(self, name):
        for file in ("mesh.ply", "mesh.glb", "trajectory.tum"):
            self.assertEqual((self.folder / name / file).read_bytes(), (self.folder / "whole" / file).read_bytes(), file)
        ours, theirs = (self.run_json("info", f"{folder}/map.hmap") for folder in (name, "whole"))
        for key in ("volumes", "volumes_with_color", "voxels_known", "voxels_inside", "bounds_m", "next_frame"):
            self.assertEqual(ours[key], theirs[key], key)
        self.assertEqual(map_pages(self.folder / name / "map.hmap"), map_pages(self.folder / "whole/map.hmap"))

    def test_kill_9_at_any_moment_then_resume(self):
        killed_midway = 0
        for saves in (1, 2, 4, 3, 5, 2, 6, 4):
            process = self.start("reconstruct", "recording", "-o", "killed", "--resume", "--quiet", *FAST)
            wait_for_saves(process, self.folder / "killed/map.hmap", saves)
            process.kill()
            process.communicate()
            state = self.run_json("info", "killed/map.hmap")
            self.assertEqual((state["volumes_damaged"], state["problems"]), (0, []))
            killed_midway += 0 < state["next_frame"] < FRAMES
        run = self.run_json("reconstruct", "recording", "-o", "killed", "--resume", *FAST)
        self.assertEqual(run["frames"], self.whole["frames"])
        self.assert_equal_to_whole("killed")
        self.assertGreater(killed_midway, 0, "every kill came before the first save or after the last")

    def test_interrupt_finishes_with_what_there_is(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(number):
                run = self.interrupted_run(f"stopped_{number.name}", number)
                self.assertTrue(any("--resume" in warning for warning in run["warnings"]))
                self.assertLess(run["frames"]["integrated"], FRAMES)
                self.assertGreater(run["triangles"], 0)
                again = self.run_json("reconstruct", "recording", "-o", f"stopped_{number.name}", "--resume", *FAST)
                self.assertEqual(again["resumed_at_frame"], run["frames"]["integrated"])
                self.assert_equal_to_whole(f"stopped_{number.name}")

    def interrupted_run(self, name, number):
        """Interrupts after ever fewer saves until the run is caught in the middle."""
        for saves in (8, 6, 4, 3, 2, 1):
            process = self.start("reconstruct", "recording", "-o", name, "--overwrite", "--json", "--quiet", *FAST)
            wait_for_saves(process, self.folder / name / "map.hmap", saves)
            process.send_signal(number)
            output, errors = process.communicate(timeout=120)
            self.assertIn(process.returncode, (0, 1), errors)
            if process.returncode == 0 and json.loads(output)["interrupted"]:
                return json.loads(output)
        self.fail("the run could not be interrupted in the middle")

    def test_resume_of_a_finished_run_changes_nothing(self):
        run = self.run_json("reconstruct", "recording", "-o", "whole", "--resume", *FAST)
        self.assertTrue(run["complete"])
        self.assertEqual(run["triangles"], self.whole["triangles"])
        self.assertEqual(run["integrate_ms"], self.whole["integrate_ms"])  # its timings, not those of doing nothing

    def test_resume_of_a_finished_run_that_left_frames_out(self):
        words = ["reconstruct", "recording", "-o", "strided", "--set", "reconstruction.frame_stride=7", *FAST]
        self.assertEqual(self.run_json(*words)["frames"]["integrated"], 9)  # 0, 7 ... 56 of 60
        again = self.run_json(*words, "--resume")
        self.assertEqual((again["complete"], again["frames"]["integrated"]), (True, 9))

    def test_resume_goes_on_with_the_parameters_of_the_map(self):
        self.run_json("reconstruct", "recording", "-o", "coarse", "--voxel", "0.06", "--set",
                      "reconstruction.frame_limit=5", *FAST)
        run = self.run_json("reconstruct", "recording", "-o", "coarse", "--resume", "--set",
                            "reconstruction.frame_limit=0")
        self.assertEqual((run["voxel_size_m"], run["frames"]["integrated"]), (0.06, FRAMES))

    def test_resume_refuses_what_does_not_fit(self):
        text = self.run_hm("reconstruct", "recording", "-o", "whole", "--resume", "--voxel", "0.05", expect=2).stderr
        for part in ("voxel_size_m = 0.02", "now 0.05", "--resume"):
            self.assertIn(part, text)
        self.simulate("other", 5, "corridor")
        text = self.run_hm("reconstruct", "other", "-o", "whole", "--resume", expect=2).stderr
        self.assertIn("another recording", text)

    def test_resume_from_a_damaged_map_is_an_input_error(self):
        path = self.folder / "whole/map.hmap"
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
        text = self.run_hm("reconstruct", "recording", "-o", "whole", "--resume", expect=3).stderr
        self.assertIn("map.hmap", text)


    def test_resume_of_a_crafted_or_foreign_map_is_refused_in_words(self):
        path = self.folder / "whole/map.hmap"
        change_header(path, lambda header: header.update(voxel_size_m=0.04))
        text = self.run_hm("reconstruct", "recording", "-o", "whole", "--resume", expect=3).stderr
        self.assertIn("its header says voxels of 0.04 m", text)
        change_header(path, lambda header: header.update(voxel_size_m=1e300))
        text = self.run_hm("reconstruct", "recording", "-o", "whole", "--resume", expect=3).stderr
        self.assertIn("voxel size of 1e+300 m", text)
        change_header(path, lambda header: header.update(voxel_size_m=0.02, state_json=""))
        text = self.run_hm("reconstruct", "recording", "-o", "whole", "--resume", expect=2).stderr
        self.assertIn("not made by `hm reconstruct`", text)
        change_header(path, lambda header: header.update(last_row=2**62))
        self.assertTrue(self.run_json("info", path)["problems"])  # and it ends


def change_header(path, change):
    """Changes the header of a map as an attacker would, who can compute its checksum."""
    database = sqlite3.connect(path)
    header = json.loads(database.execute("select content from header").fetchone()[0])
    change(header)
    text = json.dumps(header, indent=2)
    checksum = 0xcbf29ce484222325
    for byte in text.encode():
        checksum = (checksum ^ byte) * 0x100000001b3 % 2**64
    signed = checksum - 2**64 if checksum >= 2**63 else checksum
    database.execute("update header set checksum = ?, content = ?", (signed, text))
    database.commit()
    database.close()


def map_pages(path):
    """The pages of a map, without the order in which they were written."""
    database = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
    columns = [row[1] for row in database.execute("pragma table_info(pages)") if row[1] != "id"]
    pages = sorted(map(repr, database.execute(f"select {', '.join(columns)} from pages")))
    database.close()
    assert pages and columns
    return pages


if __name__ == "__main__":
    support.main()
