"""hm fly --autopilot qemu: the program flies by the emulated board, with the bits of the host's core."""
import os
import sys
from pathlib import Path

import emulator

sys.path.insert(0, str(emulator.SOURCE / "tests" / "program"))
import support  # noqa: E402

IMAGE = Path(os.environ["HM_FIRMWARE"]) / "flight.elf"
QUICK = ["--set", "laser.pictures=false"]


class FlyOnTheBoard(support.ProgramTest):
    def hover(self, name, *more, **options):
        return self.run_json("fly", "hover", "--duration", 4, "-o", name, *QUICK, *more, **options)

    def on_board(self, name, *more, image=IMAGE, **options):
        return self.hover(name, "--autopilot", "qemu", "--firmware", image, *more, **options)

    def test_end_to_end(self):
        run, host = self.on_board("board"), self.hover("host")
        self.assertEqual(run["end_state"], "landed")
        self.assertEqual(run["collisions"], 0)
        for key in ("hover", "path_length_m", "flight_s", "failsafes", "orders"):
            self.assertEqual(run[key], host[key], key)
        # What the board was given and what it did, to the bit: every step of the flight.
        self.assertEqual((self.folder / "board/core.trace").read_bytes(), (self.folder / "host/core.trace").read_bytes())
        self.check_results("board", ["recording.bag", "core.trace", "trajectory.tum", "flight.svg"], ["commanded"])

    def test_parameters_that_the_firmware_does_not_have(self):
        error = self.on_board("x", "--set", "guidance.takeoff_climb_m_s=0.4", expect=2)["error"]
        self.assertIn("the firmware flies with its default", error["message"])

    def test_what_is_missing_is_named_with_its_package(self):
        error = self.on_board("x", image="none.elf", expect=3)["error"]
        self.assertIn("gcc-arm-none-eabi", error["message"])
        self.assertEqual(error["where"], "none.elf")
        empty = self.folder / "no_programs"
        empty.mkdir()
        error = self.on_board("x", expect=3, PATH=str(empty))["error"]
        self.assertIn("install the package qemu-system-arm", error["message"])
        self.assertFalse((self.folder / "x").exists())


if __name__ == "__main__":
    support.main()
