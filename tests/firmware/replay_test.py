#!/usr/bin/env python3
"""The firmware's core in an emulator repeats a flight of the host's core: same bits, within its bars; a fault is found."""
import os
import struct
import sys
import tempfile
import unittest
import zlib
from pathlib import Path

import emulator

FOLDER = Path(os.environ["HM_FIRMWARE"])
RECORD, STEP, KIND, INPUT, ESTIMATE = 128, 0, 16, 20, 88  # core_trace.hpp


class Replay(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.work = tempfile.TemporaryDirectory(prefix="hm_firmware_")
        cls.addClassCleanup(cls.work.cleanup)
        cls.trace = Path(cls.work.name, "core.trace")
        emulator.fly_trace(cls.trace)
        cls.bytes = cls.trace.read_bytes()

    def replay_of(self, data):
        path = Path(self.work.name, "other.trace")
        path.write_bytes(data)
        return emulator.replay(FOLDER, path)

    def changed(self, step, offset, value):
        """The trace with a float of a step changed by `value`, its checksum right; up to 500 steps later."""
        data = bytearray(self.bytes)
        steps = [at for at in range(0, len(data), RECORD) if data[at + KIND] == STEP]
        at = steps[step - 1]
        old = struct.unpack_from("<f", data, at + offset)[0]
        struct.pack_into("<f", data, at + offset, old + value)
        struct.pack_into("<I", data, at + 124, zlib.crc32(data[at:at + 124]))
        return data[:steps[step + 500]]

    def test_gives_the_bits_of_the_host_within_the_bars(self):
        code, measured = emulator.replay(FOLDER, self.trace)
        mean, worst = emulator.instructions(measured)
        used = emulator.stack_used(FOLDER, measured)
        print(f"{measured}\ninstructions: mean {mean:.0f}, worst {worst:.0f}; stack: {used}")
        self.assertEqual(code, 0, measured)
        steps = sum(self.bytes[at + KIND] == STEP for at in range(0, len(self.bytes), RECORD))
        self.assertEqual(measured["steps"], steps)
        self.assertGreater(steps, 20_000)
        self.assertLessEqual(mean, emulator.MOST_MEAN)
        self.assertLessEqual(worst, emulator.MOST_WORST)
        self.assertGreater(mean, 1000)
        self.assertLessEqual(used, emulator.memory(FOLDER)[2] - 128)

    def test_a_recorded_bit_that_differs_is_found_in_its_step(self):
        code, found = self.replay_of(self.changed(4000, ESTIMATE + 4, 1e-6))
        self.assertEqual(code, 1, found)
        self.assertEqual((found["difference"], found["index"], found["step"]), ("position", 1, 4000))
        self.assertNotEqual(found["recorded_bits"], found["replayed_bits"])

    def test_a_bug_planted_in_one_of_the_cores_is_found(self):
        path = Path(self.work.name, "bug.trace")
        emulator.fly_trace(path, "planted-bug")
        code, found = emulator.replay(FOLDER, path)
        self.assertEqual(code, 1, found)
        self.assertEqual(found["difference"], "rotor speed")
        self.assertGreater(found["step"], 1000)  # on the ground no gain counts

    def test_another_input_gives_other_outputs(self):
        code, found = self.replay_of(self.changed(4000, INPUT + 4, 0.01))  # pitch rate
        self.assertEqual(code, 1, found)
        self.assertEqual((found["difference"], found["step"]), ("rotor speed", 4000))

    def test_a_cut_trace_is_replayed_to_its_last_whole_record(self):
        data = self.bytes[:1000 * RECORD + 77]
        code, found = self.replay_of(data)
        self.assertEqual(code, 0, found)
        self.assertEqual(found["steps"], sum(data[at + KIND] == STEP for at in range(0, 1000 * RECORD, RECORD)))

    def test_a_missing_trace_is_an_error(self):
        code, _ = emulator.replay(FOLDER, Path(self.work.name, "nowhere.trace"))
        self.assertEqual(code, 2)


if __name__ == "__main__":
    reason = emulator.missing() or (None if (FOLDER / "replay.elf").is_file() else f"{FOLDER} holds no firmware")
    if reason:
        print(f"skipped: {reason}")
        sys.exit(77)
    unittest.main(verbosity=2)
