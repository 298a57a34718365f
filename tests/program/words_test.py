"""What people read: plurals, separators, units, each warning once, --quiet, the line that opens the report, progress
within the terminal's width, the README's flight."""
import fcntl
import json
import os
import pty
import re
import shlex
import struct
import subprocess
import termios

import support

FAST = ["--set", "reconstruction.pictures=false", "--set", "mesh_error.samples=20000"]
PAGE_FAST = ["--set", "slam.matrices=false", *FAST]
# "1 keyframes", but not "1 s", "0.1 ms" or "11 frames".
WRONG_PLURAL = re.compile(r"(?<![\w.,-])1 (?!(?:is|was|has|ms|times as|of)\b)[a-z]+s\b")
# Four digits and more without a separator, but no decimals and nothing in a name: 640395.
NO_SEPARATOR = re.compile(r"(?<![\w.,/_+-])\d{4,}(?![\w./_])")


class Words(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        keeper.simulate("recording", 12)
        keeper.run_hm("reconstruct", "recording", "-o", "result", "--quiet", *FAST)
        Words.recording, Words.result = keeper.folder / "recording", keeper.folder / "result"

    def printed(self, *words):
        result = self.run_hm(*words)
        return result.stdout + result.stderr

    def test_one_thing_has_no_plural(self):
        self.simulate("one", 1)
        texts = [self.printed("info", "one"), self.printed("reconstruct", "one", "-o", "of_one", *FAST),
                 self.printed("info", "of_one/trajectory.tum"), self.printed("odometry", "one", "-o", "tracked"),
                 self.printed("slam", "one", "-o", "whole", *PAGE_FAST)]
        for text in texts:
            self.assertIsNone(WRONG_PLURAL.search(text), text)
        self.assertIn("1 of 1 frame integrated", texts[1])
        self.assertIn("trajectory of 1 pose,", texts[2])
        self.assertIn("1 keyframe,", texts[3])
        page = (self.folder / "whole/report.html").read_text()
        self.assertIsNone(WRONG_PLURAL.search(re.sub(r"<(style|svg|pre).*?</\1>", "", page, flags=re.S)))

    def test_large_numbers_have_separators_and_voxels_stand_in_blocks(self):
        again = self.run_hm("reconstruct", self.recording, "-o", "again", *FAST).stdout
        shown = self.run_json("info", self.result / "map.hmap")
        text = self.run_hm("info", self.result / "map.hmap").stdout
        self.assertIn(f"in {shown['volumes']:,} blocks of 8 x 8 x 8", text)
        self.assertIn(f"{shown['voxels_known']:,} voxels", text)
        self.assertRegex(text, r"distances to the surface are stored in steps of 0\.00\d+ mm")
        for one in (again, text, self.run_hm("info", self.result / "mesh.ply").stdout,
                    self.run_hm("info", self.recording).stdout, self.run_hm("info", self.result).stdout):
            self.assertIsNone(NO_SEPARATOR.search(one), one)
            self.assertNotIn("volumes", one)

    def test_small_files_have_a_size(self):
        shown = self.run_hm("info", self.result).stdout
        self.assertRegex(shown, r"parameters\.toml, [1-9]\d*\.\d kB")
        self.assertNotRegex(shown, r"\b0\.0+ [kM]B")

    def test_a_resumed_run_without_new_frames_states_no_speed(self):
        self.run_hm("reconstruct", self.recording, "-o", "done", "--quiet", *FAST)
        record = self.folder / "done/run.json"
        state = json.loads(record.read_text())
        for complete in (True, False):  # the second as if it had been killed after its last save
            if not complete:
                record.write_text(json.dumps({**state, "state": "stopped"}))
            text = self.run_hm("reconstruct", self.recording, "-o", "done", "--resume", *FAST).stdout
            self.assertIn("already complete" if complete else "12 of 12 frames integrated by earlier runs", text)
            self.assertNotRegex(text, r"\b0\.0+ (frames|ms)")
            self.assertEqual(text.splitlines()[-1], "open done/report.html")

    def test_distorted_images_are_undistorted_on_reading(self):
        recording = self.simulate("distorted", 2)
        path = recording / "camera.txt"
        path.write_text(path.read_text().replace("\nk1 0\n", "\nk1 0.01\n"))
        self.assertIn("undistorted on reading", self.run_hm("info", recording).stdout)

    def test_info_prints_each_warning_once(self):
        broken = self.simulate("broken", 4)
        next((broken / "depth").glob("*.png")).unlink()
        flight = self.folder / "flight.log"
        flight.write_text("".join(f"FLASER 4 1 2 3 4 0 0 0 {0.1 * i} 0 0 {t} host {t}\n"
                                  for i, t in enumerate([1.0, 1.1, 1.2, 9.0, 9.1, 9.2, 9.3, 9.4, 9.5])))
        for path in (broken, flight):
            warnings = self.run_json("info", path)["warnings"]
            self.assertGreater(len(warnings), 0, path)
            text = self.printed("info", path)
            for warning in warnings:
                self.assertEqual(text.count(warning), 1, text)

    def test_quiet_prints_nothing_but_errors(self):
        broken = self.simulate("broken", 6)
        next((broken / "depth").glob("*.png")).unlink()  # a warning
        for words in (["reconstruct", broken, "-o", "out", *FAST], ["info", broken], ["odometry", broken, "-o", "tracked"],
                      ["simulate", "room", "-o", "new", "--frames", 2], ["convert", "out/mesh.ply", "mesh.obj"]):
            result = self.run_hm(*words, "--quiet")
            self.assertEqual((result.stdout, result.stderr), ("", ""), words)
        result = self.run_hm("info", broken, "--quiet", "--json")
        self.assertEqual((result.stdout[0], result.stderr), ("{", ""))
        result = self.run_hm("info", "nowhere", "--quiet", expect=3)
        self.assertEqual(result.stdout, "")
        self.assertIn("hm: ", result.stderr)

    def test_the_last_line_opens_the_report(self):
        fast = {"reconstruct": FAST, "odometry": [], "slam": PAGE_FAST}
        for verb, more in fast.items():
            text = self.run_hm(verb, self.recording, "-o", f"of_{verb}", *more).stdout
            self.assertEqual(text.splitlines()[-1], f"open of_{verb}/report.html")
            self.assertTrue((self.folder / f"of_{verb}/report.html").exists())
        evaluated = self.run_hm("evaluate", "trajectory", "of_odometry/trajectory.tum", self.recording, "--report", "ate.html")
        self.assertEqual(evaluated.stdout.splitlines()[-1], "open ate.html")
        evaluated = self.run_hm("evaluate", "mesh", "of_reconstruct/mesh.ply", self.recording, "--report", "mesh.html", *FAST)
        self.assertEqual(evaluated.stdout.splitlines()[-1], "open mesh.html")
        demo = self.run_hm("demo", "-o", "demo", "--set", "simulation.frame_limit=4", *FAST)
        self.assertEqual(demo.stdout.splitlines()[-1], "open demo/result/report.html")
        self.assertNotIn("open ", self.run_hm("info", self.recording).stdout)

    def test_the_last_line_of_a_calibration_opens_its_report(self):
        (self.folder / "set").symlink_to(support.simulated(*support.SMALL_SET)[0])
        for words in (["intrinsics", "set/color", "-o", "color"], ["intrinsics", "set/ir", "-o", "both", "--camera", "depth",
                                                                 "--calibration", "color"],
                      ["extrinsics", "set/stereo/ir", "set/stereo/color", "--calibration", "both", "-o", "rig"],
                      ["depth", "set/depth", "--calibration", "rig", "-o", "corrected"],
                      ["noise", "set/depth", "-o", "noise"]):
            text = self.run_hm("calibrate", *words).stdout
            folder = words[words.index("-o") + 1]
            self.assertEqual(text.splitlines()[-1], f"open {folder}/report.html")

    def test_the_readme_flies_for_half_a_minute_through_rooms(self):
        readme = (support.SOURCE / "README.md").read_text()
        line = next(line for line in readme.splitlines() if "laser_mav" in line and line.startswith("./hm simulate"))
        words = shlex.split(line)[1:]
        flight = self.run_json(*words)
        self.assertGreater(flight["duration_s"], 25)
        self.assertGreater(flight["path_length_m"], 10)
        folder = words[words.index("-o") + 1]
        self.check_laser_words(folder)

    def check_laser_words(self, folder):
        """The path is the true one but for the error of the poses; both frames are explained once."""
        stamps = [line.split()[0] for line in (self.folder / folder / "groundtruth.txt").read_text().splitlines()[::400]
                  if not line.startswith("#")]
        zeros = "0 0 0 0 0 0"
        relations = [f"{a} {b} {zeros}" for a, b in zip(stamps[2:-2], stamps[3:-1])] + [f"9999 {9999 + i} {zeros}" for i in (1, 2)]
        (self.folder / "known.relations").write_text("\n".join(relations) + "\n")
        info = self.run_json("info", folder)
        text = self.run_hm("laser", folder, "-o", "flown", "--relations", "known.relations", "--set", "laser.pictures=false")
        shown = re.search(r"path ([\d.]+) m \(true path ([\d.]+) m\)", text.stdout)
        true_path_m = info["truth"]["path_length_m"]
        self.assertAlmostEqual(float(shown[2]), true_path_m, delta=0.01 * true_path_m)
        self.assertAlmostEqual(float(shown[1]), true_path_m, delta=0.02 * true_path_m)
        self.assertAlmostEqual(self.run_json("info", "flown/trajectory.tum")["path_length_m"], float(shown[1]), delta=0.01)
        self.assertIn(f"2 of {len(relations)} relations have no pose at their times", text.stderr)
        self.assertEqual(text.stdout.splitlines()[-1], "open flown/report.html")
        for one in (text.stdout, text.stderr):
            self.assertIsNone(NO_SEPARATOR.search(one), one)
            self.assertIsNone(WRONG_PLURAL.search(one), one)
        page = (self.folder / "flown/report.html").read_text()
        self.assertEqual(page.count("odom is the frame of scan matching"), 1)
        self.assertNotIn("in odom", page)

    def progress_lines(self, width, environment):
        """What a run draws on a terminal of this width, one entry for each time that it draws its line."""
        master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, width, 0, 0))
        process = subprocess.Popen([support.PROGRAM, "reconstruct", self.recording, "-o", f"drawn{len(os.listdir(self.folder))}", *FAST],
                                   cwd=self.folder, stdout=subprocess.DEVNULL, stderr=slave,
                                   env={**os.environ, "TERM": "xterm", **environment})
        os.close(slave)
        drawn = b""
        try:
            while part := os.read(master, 65536):
                drawn += part
        except OSError:  # the other end is closed
            pass
        os.close(master)
        self.assertEqual(process.wait(), 0)
        return [line.decode() for line in re.split(rb"\r|\n|\x1b\[K", drawn) if line]

    def test_progress_fits_the_terminal(self):
        for width, environment, most in ((200, {}, 200), (40, {"COLUMNS": "300"}, 40), (18, {}, 18),
                                         (0, {"COLUMNS": "30"}, 30), (0, {"COLUMNS": "wide"}, 80)):
            lines = self.progress_lines(width, environment)
            self.assertGreater(len(lines), 1)
            longest = max(map(len, lines))
            self.assertLess(longest, most, lines)
            if most < 60:  # as much as fits
                self.assertEqual(longest, most - 1, lines)


if __name__ == "__main__":
    support.main()
