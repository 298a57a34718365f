#!/usr/bin/env python3
"""Builds the firmware, and checks what it contains and how large it is."""
import os
import re
import subprocess
import sys
import unittest
from pathlib import Path

import emulator

FOLDER = Path(os.environ["HM_FIRMWARE"])
# Double precision in software, the heap, exceptions and run-time types, input and output.
FORBIDDEN = re.compile(r"^(__aeabi_(d|f2d|i2d|ui2d|l2d|ul2d)\w*|_?(malloc|calloc|realloc|free)(_r)?|_Zn[wa]\w*|_Zd[la]\w*|"
                       r"__cxa_(throw|begin_catch|allocate_exception)|_ZTI\w*|__dynamic_cast|_?(printf|fopen|write|sbrk))$")


class Image(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        emulator.build(FOLDER)

    def test_needs_no_heap_exceptions_or_double_precision(self):
        listing = subprocess.run(["arm-none-eabi-nm", FOLDER / "flight.elf"], capture_output=True, text=True, check=True).stdout
        names = [line.split()[-1] for line in listing.splitlines()]
        self.assertTrue(any("Autopilot4step" in name for name in names))
        self.assertEqual([name for name in names if FORBIDDEN.match(name)], [])
        for planted in ("__aeabi_dadd", "__aeabi_f2d", "malloc", "_malloc_r", "_Znwj", "_ZdlPv", "__cxa_throw", "_ZTIi", "printf"):
            self.assertTrue(FORBIDDEN.match(planted), planted)
        for allowed in ("__aeabi_ldivmod", "__aeabi_f2lz", "_ZN2hm9AutopilotC1Ev", "memcpy"):
            self.assertFalse(FORBIDDEN.match(allowed), allowed)

    def test_fits_the_board(self):
        flash, ram, stack = emulator.memory(FOLDER)
        print(f"flash: {flash}\nram: {ram}, of which stack: {stack}")
        self.assertLessEqual(flash, emulator.MOST_FLASH)
        self.assertLessEqual(ram, emulator.MOST_RAM)
        self.assertGreater(ram, 10_000)


if __name__ == "__main__":
    if reason := emulator.missing():
        print(f"skipped: {reason}")
        sys.exit(77)
    unittest.main(verbosity=2)
