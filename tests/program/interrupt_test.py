"""Ctrl-C or a kill in the middle of a simulation: it ends soon, leaves nothing that looks whole, and can be run again."""
import json
import signal
import time

import support

SOON_S = 10  # the whole walk takes minutes; a stop waits for a few frames, whatever else the machine does
SHORT = ["--set", "simulation.frame_limit=5", "--set", "mesh_error.samples=20000", "--set",
         "reconstruction.pictures=false"]


class Interrupt(support.ProgramTest):
    def start_and_wait(self, recording, *words):
        """Starts a simulation of the whole house; returns its process when a few pictures are written."""
        process = self.start(*words)
        self.addCleanup(process.kill)
        pictures = self.folder / recording / "depth"
        while process.poll() is None and not (pictures.is_dir() and len(list(pictures.iterdir())) > 20):
            time.sleep(0.01)
        self.assertIsNone(process.poll(), "it ended before it could be stopped")
        return process

    def check_stop(self, recording, number, *words):
        process = self.start_and_wait(recording, *words, "--json")
        asked = time.monotonic()
        process.send_signal(number)
        output, errors = process.communicate(timeout=60)
        self.assertLess(time.monotonic() - asked, SOON_S)
        self.assertEqual(process.returncode, 1, errors)
        error = json.loads(output)["error"]
        self.assertEqual(error["code"], "cancelled")
        self.assertRegex(error["message"], r"stopped at frame \d+ of \d+; nothing of it was kept")
        self.assertIn("stopping: ", errors)
        self.assertFalse((self.folder / recording).exists())

    def test_simulate_stopped(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(number):
                self.check_stop("house", number, "simulate", "house", "-o", "house")
        self.run_json("simulate", "house", "-o", "house", "--frames", 5)

    def test_demo_stopped(self):
        self.check_stop("demo/recording", signal.SIGINT, "demo", "-o", "demo")
        self.assertFalse((self.folder / "demo").exists())
        self.assertEqual(self.run_json("demo", "-o", "demo", *SHORT)["frames"]["integrated"], 5)

    def test_killed(self):
        for recording, words in (("house", ["simulate", "house", "-o", "house"]),
                                 ("demo/recording", ["demo", "-o", "demo"])):
            with self.subTest(words[0]):
                process = self.start_and_wait(recording, *words)
                process.kill()
                process.communicate()
                self.assertFalse((self.folder / recording / "simulation.toml").exists())
                self.run_json("info", recording, expect=3)  # not taken for a recording
                self.run_json(*words, *SHORT)
                self.assertEqual(self.run_json("info", recording)["frames"], 5)


if __name__ == "__main__":
    support.main()
