"""What the tests of hm scan share: replays, OpenNI without hardware, the count of frames."""
import json
import os
import subprocess
import time

import support

QUICK = ["--voxel", "0.06", "--set", "reconstruction.pictures=false", "--set", "slam.matrices=false"]
CAPTURE = {"camera", "captured", "tracked", "lost", "unusable", "dropped", "recorded", "latency_ms", "rate_hz"}


class ScanTest(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        keeper.simulate("room", 60, "room", "--sensor", "kinect")
        cls.recording = keeper.folder / "room"

    def check_capture(self, capture):
        """Not a single frame is uncounted."""
        self.assertLessEqual(CAPTURE, set(capture))
        drops = {key: value for key, value in capture["dropped"].items() if key != "total"}
        self.assertEqual(capture["dropped"]["total"], sum(drops.values()))
        self.assertEqual(capture["captured"],
                         capture["tracked"] + capture["lost"] + capture["unusable"] + capture["dropped"]["total"])
        usable = capture["captured"] - sum(n for key, n in drops.items() if key != "queue_full")
        self.assertEqual(capture["recorded"] + capture["not_recorded"], usable)

    def replay(self, *words, expect=0):
        return self.run_json("scan", "--camera", f"replay:{self.recording}", *QUICK, *words, expect=expect)

    def stamps(self, recording):
        lines = (self.folder / recording / "depth.txt").read_text().splitlines()
        return [line.split()[0] for line in lines if not line.startswith("#")]

    def wait_for_frames(self, recording, frames, process):
        """Until so many frames lie in the recording of a scan that runs."""
        def are_there():
            return (self.folder / recording / "depth.txt").exists() and len(self.stamps(recording)) >= frames
        end = time.monotonic() + 60
        while not are_there() and process.poll() is None and time.monotonic() < end:
            time.sleep(0.02)
        self.assertTrue(are_there(), process.poll())

    def start_replay(self, output, *words):
        process = self.start("scan", "--camera", f"replay:{self.recording}", "-o", output, "--json", *QUICK, *words)
        self.addCleanup(process.kill)
        return process

    def run_with(self, variables, *words, expect=0):
        result = subprocess.run([support.PROGRAM, "scan", *map(str, words), "--json", *QUICK], cwd=self.folder,
                                capture_output=True, text=True, timeout=300, env={**os.environ, **variables})
        self.assertEqual(result.returncode, expect, result.stdout[-2000:] + result.stderr[-2000:])
        return json.loads(result.stdout[result.stdout.index("{\n"):])  # a stand-in of a library may print

    def openni(self, **variables):
        folder = os.environ.get("HM_OPENNI")
        if not folder:
            self.skipTest("built without OpenNI")
        return {"LD_LIBRARY_PATH": folder, "HM_OPENNI_RECORDING": str(self.recording), **variables}
