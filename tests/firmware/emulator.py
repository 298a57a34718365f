"""Builds the firmware, repeats recorded flights on it in QEMU, and reads its sizes; for the tests and bench/run."""
import os
import re
import shutil
import subprocess
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
# Bars of the core on a Cortex-M4F: bytes; instructions of a step.
MOST_FLASH, MOST_RAM, MOST_MEAN, MOST_WORST = 64 * 1024, 16 * 1024, 10_000, 60_000
TICKS_PER_INSTRUCTION = 0.168  # an instruction takes 1 ns of the emulator, whose processor has 168 MHz
REPLAY_STACK_EXTRA = 1024      # of replay.elf, beside that of flight.elf (firmware/CMakeLists.txt)


def missing():
    """Why there can be no firmware or no emulator, with the package; None when all is there."""
    for program, package in (("arm-none-eabi-g++", "gcc-arm-none-eabi"), ("qemu-system-arm", "qemu-system-arm"),
                             ("cmake", "cmake"), ("ninja", "ninja-build")):
        if not shutil.which(program):
            return f"no {program}: install the package {package}"
    if not list(Path("/usr/include/newlib/c++").glob("*/array")):
        return "no C++ headers for the compiler: install the package libstdc++-arm-none-eabi-dev"
    return None


def build(folder):
    for words in (["cmake", "-S", SOURCE / "firmware", "-B", folder, "-G", "Ninja"], ["ninja", "-C", folder]):
        done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"{' '.join(map(str, words))} failed:\n{done.stdout[-4000:]}")


def fly_trace(path, *more):
    """Flies the course of the flight tests on the host and writes its core.trace."""
    subprocess.run([os.environ["HM_FLY_TRACE"], path, *more], check=True, capture_output=True)


def replay(folder, trace):
    """(exit code, {name: value}) of replay.elf on a trace; instructions are counted."""
    done = subprocess.run(["qemu-system-arm", "-machine", "netduinoplus2", "-display", "none", "-monitor", "none", "-serial",
                           "null", "-icount", "shift=0", "-semihosting-config", f"enable=on,target=native,arg={trace}",
                           "-kernel", Path(folder, "replay.elf")], capture_output=True, text=True, timeout=300, check=False)
    found = dict(line.split(": ", 1) for line in (done.stdout + done.stderr).splitlines() if ": " in line)
    return done.returncode, {name: int(value) if value.isdigit() else value for name, value in found.items()}


def sections(image):
    listing = subprocess.run(["arm-none-eabi-size", "-A", image], capture_output=True, text=True, check=True).stdout
    return {match[1]: int(match[2]) for match in re.finditer(r"^(\.\w+)\s+(\d+)", listing, re.M)}


def memory(folder):
    """(flash, RAM with the whole stack, stack) of flight.elf, bytes."""
    size = sections(Path(folder, "flight.elf"))
    return size[".text"] + size[".data"], size[".stack"] + size[".data"] + size[".bss"], size[".stack"]


def instructions(measured):
    """(mean, worst) of a step."""
    return measured["mean_ticks"] / TICKS_PER_INSTRUCTION, measured["worst_ticks"] / TICKS_PER_INSTRUCTION


def stack_used(folder, measured):
    """Bytes of the stack that replay.elf used, which are more than those of flight.elf."""
    return sections(Path(folder, "replay.elf"))[".stack"] - measured["stack_unused_bytes"]
