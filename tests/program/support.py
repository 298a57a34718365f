"""Runs the built program in a folder of its own; what the program tests share."""
import atexit
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from functools import lru_cache
from pathlib import Path

PROGRAM = os.environ.get("HM_PROGRAM", "build/release/bin/hm")
SOURCE = Path(os.environ.get("HM_SOURCE_DIR", Path(__file__).resolve().parents[2]))
COMMON_KEYS = {"verb", "ok", "version", "wall_s", "peak_rss_bytes", "warnings", "outputs"}
# Boards for a calibration of both cameras, as few as calibrate.
SMALL_SET = ["calibration"] + [word for assignment in ("camera_views=12", "stereo_views=8", "depth_steps=3", "test_steps=2",
                                                       "depth_images=6")
                               for word in ("--set", f"calibration_simulation.{assignment}")]


def real_data():
    """The folder with real recordings, or None."""
    folder = Path(os.environ.get("HM_DATA", SOURCE.parent / "shared" / "data"))
    return folder if (folder / "rgbd").is_dir() else None


@lru_cache(maxsize=None)
def simulations():
    """The folder of the simulations that tests share: in the build folder, for this build of the program only."""
    program = Path(PROGRAM).resolve()
    if not (program.parent.parent / "CMakeCache.txt").exists():  # an installed one
        folder = Path(tempfile.mkdtemp(prefix="hm_simulations_"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        return folder
    status = program.stat()
    folder = program.parent.parent / "test_simulations" / f"{program.name}-{status.st_size}-{status.st_mtime_ns}"
    for other in folder.parent.glob(f"{program.name}-*"):
        if other != folder:
            shutil.rmtree(other, ignore_errors=True)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def simulated(*words):
    """Folder and report of `hm simulate` with these words, which is run once for all tests; not to be changed."""
    words = list(map(str, words))
    folder = simulations() / hashlib.sha256("\0".join(words).encode()).hexdigest()[:16]
    if not folder.exists():
        made = Path(tempfile.mkdtemp(prefix="making_", dir=folder.parent))
        try:
            run = subprocess.run([PROGRAM, "simulate", *words, "-o", made / "out", "--json", "--quiet"], stdout=subprocess.PIPE,
                                 check=True, timeout=500)
            (made / "report.json").write_bytes(run.stdout)
            made.rename(folder)
        except OSError:
            if not folder.exists():  # else another test was faster
                raise
        finally:
            shutil.rmtree(made, ignore_errors=True)
    return folder / "out", json.loads((folder / "report.json").read_text())


class ProgramTest(unittest.TestCase):
    """A test in a temporary folder, self.folder, which is removed afterwards."""

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="hm_test_"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def start(self, *words, **options):
        return subprocess.Popen([PROGRAM, *map(str, words)], cwd=self.folder, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True, **options)

    def run_hm(self, *words, expect=0, **environment):
        result = subprocess.run([PROGRAM, *map(str, words)], cwd=self.folder, capture_output=True, text=True,
                                timeout=500, env={**os.environ, **environment})
        self.assertEqual(result.returncode, expect,
                         f"hm {' '.join(map(str, words))}\n{result.stdout[-3000:]}\n{result.stderr[-3000:]}")
        return result

    def run_json(self, *words, expect=0, **environment):
        """Runs with --json; the one object on standard output, its common keys checked."""
        result = self.run_hm(*words, "--json", expect=expect, **environment)
        document = json.loads(result.stdout)  # fails on anything before or after the object
        self.assertIsInstance(document, dict)
        self.assertLessEqual(COMMON_KEYS, set(document), words)
        self.assertEqual(document["ok"], expect == 0)
        self.assertEqual(document["verb"], str(words[0]))
        self.assertGreater(document["peak_rss_bytes"], 1_000_000)
        if expect != 0:
            self.assertTrue(document["error"]["message"])
            self.assertIn(document["error"]["message"].splitlines()[0][:40], result.stderr)
        for path in document["outputs"]:
            self.assertTrue((self.folder / path).exists(), f"{path} was named but is not there")
        return document

    def simulate(self, name="recording", frames=24, world="room", *more):
        """A copy of a recording that was simulated for all tests."""
        return Path(shutil.copytree(simulated(world, "--frames", frames, *more)[0], self.folder / name))

    def interrupt(self, process, timeout=60):
        """Ctrl-C: the run finishes with what there is; what it prints, and what it says."""
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=timeout)
        self.assertEqual(process.returncode, 0, errors)
        run = json.loads(output)
        self.assertTrue(run["interrupted"])
        return run, errors

    def check_results(self, result, names, words):
        """The files of a run are there; its page is self-contained and holds the words; its parameters read back."""
        for name in names:
            self.assertGreater((self.folder / result / name).stat().st_size, 20, name)
        page = (self.folder / result / "report.html").read_text()
        self.assertNotRegex(page, r"<script[^>]*src|<link|src=[\"']?http|url\(http", "the page is not self-contained")
        for word in words:
            self.assertIn(word, page)
        json.loads((self.folder / result / "report.json").read_text())
        self.run_hm("params", "check", f"{result}/parameters.toml")


class SharedFolderTest(ProgramTest):
    """Tests that share what `prepare(keeper)` makes once in the folder of the keeper, which outlives them."""

    def setUp(self):
        super().setUp()
        cls = type(self)
        if not hasattr(cls, "prepared"):
            cls.keeper = cls("run_hm")
            ProgramTest.setUp(cls.keeper)
            cls.prepare(cls.keeper)
            cls.prepared = True

    @classmethod
    def tearDownClass(cls):
        if hasattr(cls, "keeper"):
            shutil.rmtree(cls.keeper.folder, ignore_errors=True)


def main():
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[1:]])
