"""What a new user waits for, and what another processor computes: building and packages, each as its own command does it."""
import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
COLD = {**os.environ, "CCACHE_DISABLE": "1"}


def run(*words, accepted=(0,), **options):
    """What a command prints, on both streams."""
    done = subprocess.run([str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, **options)
    if done.returncode not in accepted:
        raise RuntimeError(f"{' '.join(map(str, words))}: {done.stdout[-1000:]}")
    return done.stdout


def slowest_step_s(ninja_log):
    """(seconds, name) of the longest step in a log of ninja."""
    steps = [line.split("\t") for line in Path(ninja_log).read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    milliseconds, name = max((int(step[1]) - int(step[0]), step[3]) for step in steps)
    return milliseconds / 1000, Path(name).name


def first_picture(work):
    """A clean Debian until the demo's first picture."""
    measured = json.loads(run(sys.executable, ROOT / "bench" / "first_picture", "--json").splitlines()[-1])
    return {"first_picture": measured["total_s"]}, measured


def product_build(work):
    """All but the tests, its packages there, nothing compiled before."""
    clone = Path(work) / "clone"
    run("git", "clone", "--quiet", ROOT, clone)
    begin = time.monotonic()
    run("./hm", "build", "all", cwd=clone, env=COLD)
    total_s = time.monotonic() - begin
    slowest_s, slowest = slowest_step_s(clone / "build" / "release" / ".ninja_log")
    return {"product_build": total_s, "product_build_unit": slowest_s}, {"slowest": slowest}


def deb_picture(work):
    """The package into a clean Debian until the demo's first picture."""
    found = re.search(r"deb_picture: installed in ([\d.]+) s, first picture after ([\d.]+) s", run("./hm", "package", "--test", cwd=ROOT))
    if not found:
        raise RuntimeError("no clean Debian can be made here (mmdebstrap, as root)")
    return {"deb_picture": float(found[2])}, {"installed_s": float(found[1])}


def arm64_bits(work):
    """Map and mesh of a short recording by the program for 64-bit ARM, under QEMU."""
    printed = run("./hm", "cross", "arm64", "--bits", cwd=ROOT, accepted=(0, 1))
    if not (same := "the same bits as here" in printed) and "gives other bits" not in printed:
        raise RuntimeError(printed[-1000:])
    return {"arm64_bits": 0 if same else 1}, {"sha256": re.findall(r"^(\w{64})  (\S+)$", printed, re.MULTILINE)}


MEASURES = {"first_picture": first_picture, "product_build": product_build, "deb_picture": deb_picture, "arm64_bits": arm64_bits}


def measure(bench, work):
    """(measured rows, details)."""
    values, details = MEASURES[bench](work)
    return [{"name": name, "ours": value, "peer": None} for name, value in values.items()], details
