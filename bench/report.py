"""The table on a terminal, what was measured (docs/benchmarks.json), and docs/benchmarks.md that is made of it."""
import collections
import datetime
import json
import os
import re
import subprocess
from pathlib import Path

import rows


def number(value):
    if value is None:
        return "-"
    if isinstance(value, tuple):
        return " to ".join(map(number, value))
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def verdict(entry):
    if "because_of" in entry:
        return f"holds only with {', '.join(entry['because_of'])}"
    return {True: "holds", False: "DOES NOT HOLD", None: "no peer"}[entry["holds"]]


def table(entries):
    lines = [f"{'row':34} {'ours':>8} {'peer':>8} {'ratio':>7} {'bar':>6} {'aim':>6}  unit"]
    for e in entries:
        lines.append(f"{e['name']:34} {number(e['ours']):>8} {number(e['peer']):>8} {number(e['ratio']):>7} "
                     f"{number(e['bar']):>6} {number(e['aim']):>6}  {e['unit']:22} {verdict(e)}")
    return "\n".join(lines)


def machine():
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            model = re.search(r"model name\s*:\s*(.*)", file.read())
    except OSError:
        model = None
    name = model[1].strip() if model else "unknown processor"
    return f"{name}, {len(os.sched_getaffinity(0))} cores for this process"


def kernel_section(details):
    """How far the integration kernel is from what the memory allows."""
    if not details:
        return ""
    lines = ["## The integration kernel and its limit", "",
             "A block has 8^3 voxels. For each voxel, distance and weight (4 bytes) are read and written once per frame, and with colour",
             "4 more bytes (stored only in blocks near a surface): 8 or 16 bytes are moved. The limits are the rates that a loop which",
             "reads, changes and writes 256 KiB (L2 cache) or 256 MiB (memory) reached in the same run:",
             f"{details['l2_gb_s']:.1f} and {details['memory_gb_s']:.1f} GB/s. sevenscenes_a, 2 cm, 8 cm band, one thread.", "",
             "| | depth only | with colour |", "|---|---|---|"]
    labels = {"volumes_per_frame": "blocks examined per frame", "voxels_per_frame": "voxels in them",
              "voxels_updated_per_frame": "voxels changed", "voxel_bytes_per_frame": "voxel bytes moved, at most",
              "image_bytes_per_frame": "image bytes read", "frame_ms": "whole frame, ms", "kernel_ms": "kernel alone, ms",
              "kernel_ns_per_voxel": "kernel, ns per examined voxel", "frame_ns_per_voxel": "frame, ns per examined voxel",
              "kernel_gb_s": "kernel, GB/s of voxel bytes", "limit_l2_ms": "limit by L2, ms",
              "limit_memory_ms": "limit by memory, ms"}
    for key, label in labels.items():
        lines.append(f"| {label} | {number(details['depth'][key])} | {number(details['color'][key])} |")
    for kind in ("depth", "color"):
        lines.append("")
        part = details[kind]
        lines.append(f"With {'colour' if kind == 'color' else 'depth only'} the kernel takes "
                     f"{part['kernel_ms'] / part['limit_memory_ms']:.0f} times what moving its bytes through memory takes: it is "
                     "bound by computing (projection, look-up of a pixel, division), not by memory.")
    return "\n".join(lines) + "\n"


def system_load():
    return round(os.getloadavg()[0], 1)


def occasion(root):
    """When, of what, where and at what load something was measured."""
    def git(*words):
        done = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=False)
        return done.stdout.strip() if done.returncode == 0 else ""
    commit = git("rev-parse", "--short=7", "HEAD") or "unknown"
    changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!docs")
    return {"date": datetime.date.today().isoformat(), "commit": commit + ("+" if changed else ""), "machine": machine(),
            "load": system_load()}


def load(path):
    """What was measured so far: `rows` by name (ours, peer, date, commit, machine, load) and `details` by bench."""
    if not Path(path).exists():
        return {"rows": {}, "details": {}}
    return json.loads(Path(path).read_text(encoding="utf-8"))


def merged(stored, found, details, when):
    """`stored` with the rows (name -> (ours, peer)) and details of a new run instead of older ones of the same names;
    rows and benches that there are no more are left out."""
    measured = {**stored["rows"], **{name: {"ours": ours, "peer": peer, **when} for name, (ours, peer) in found.items()}}
    kept = {name: measured[name] for name in rows.NAMES if name in measured}
    benches = {row.bench for row in rows.ROWS} | {"kernel_limit"}
    everything = {**stored["details"], **details}
    return {"rows": kept, "details": {key: value for key, value in everything.items()
                                      if key in benches or re.sub(r"_\d+$", "", key) in benches}}


def occasion_of(row, letters):
    """(day and commit, letter of the machine) of a stored row."""
    return f"{row['date']} {row['commit']}", letters[row["machine"]]


def beside(entry, other_occasion=None):
    """A figure in another row's line: what is judged, its bar, and when and where it was measured if not with that row."""
    value = f"{number(entry['ratio'])} times the peer" if entry["by_ratio"] else f"{number(entry['ours'])} {entry['unit']}"
    notes = [number(entry["bar"])]
    if not entry["holds"]:
        notes.append(verdict(entry))
    if other_occasion:
        notes.append(" on ".join(other_occasion))
    return f"`{entry['name']}` {value} ({'; '.join(notes)})"


def table_lines(table, entries, measured, letters):
    """The lines of a table; `entries`: all measured rows by name."""
    lines = ["", f"## {table}", "", "| row | ours | peer | ratio | bar | aim | unit | | also (bar) | judges | measured | on |",
             "|---|---|---|---|---|---|---|---|---|---|---|---|"]
    for e in (entries[name] for name in rows.lines_of(table, entries)):
        when = occasion_of(measured[e["name"]], letters)
        also = []
        for name in (name for name in rows.companions(e["name"]) if name in entries):
            other = occasion_of(measured[name], letters)
            also.append(beside(entries[name], other if other != when else None))
        lines.append(f"| `{e['name']}` | {number(e['ours'])} | {number(e['peer'])} | {number(e['ratio'])} | {number(e['bar'])} | "
                     f"{number(e['aim'])} | {e['unit']} | {verdict(e)} | {'; '.join(also)} | {e['judges']} | {' | '.join(when)} |")
    return lines if len(lines) > 5 else []


def document(stored):
    """docs/benchmarks.md: every stored row judged by the bars of today, with the day and commit it was measured at."""
    measured = stored["rows"]
    entries = [rows.judged(row, measured[row.name]["ours"], measured[row.name]["peer"])
               for row in rows.ROWS if row.name in measured]
    rows.combine(entries)
    machines = collections.defaultdict(list)
    for row in measured.values():
        machines[row["machine"]].append(row["load"])
    lines = ["# Benchmarks", "How fast, how large and how accurate housemartin is, compared with other programs in the same run and with fixed limits.",
             "`bench/run` generates this page from `benchmarks.json`; do not edit it.", ""]
    letters = {name: chr(ord("A") + i) for i, name in enumerate(machines)}
    lines += [f"Machine {letters[name]}, {len(loads)} rows: {name}, load {min(loads)} to {max(loads)} at the end of the runs.  "
              for name, loads in machines.items()]
    lines += ["", "```sh manual", "bench/run                     # measure every row and write this file",
              "bench/run --skip vo_hour      # measure all rows except these, which keep their values",
              "bench/run --update simd       # measure only these rows; the others keep their values",
              "bench/run --changed           # measure rows whose code changed since the last measurement (--list: only list them)",
              "bench/run simd threads --json # measure these rows, write no file",
              "bench/run --install-peers     # install libopen3d-dev (Open3D 0.16) first", "```"]
    for name in rows.TABLES:
        lines += table_lines(name, {entry["name"]: entry for entry in entries}, measured, letters)
    if missing := [name for name in rows.NAMES if name not in measured]:
        lines += ["", f"Not measured: {', '.join(f'`{name}`' for name in missing)}."]
    lines += ["", "`bar` is the required value, `aim` the desired one. `ratio` is peer divided by ours (more is better); without a peer,",
              "`ours` is compared with the bar. `measured`: day and commit (with a +: plus uncommitted changes),",
              "`on`: the machine. `judges`: simulation, or the part of the recordings (`bench/recordings.json`: tuning halves choose constants,",
              "judging halves do not; what closes loops needs the whole). `also`: what was measured with it or answers the same question,",
              "with its bar; some rows hold only if such others hold, as `slam_house` with `slam_house_ate`.", "", "## How it is measured", "",
              "Recordings are read from `$HM_DATA`, else from `../shared/data`. Integration uses 600 frames of `sevenscenes_a`, 640x480,",
              "with voxels of 2 cm, a truncation band of 8 cm and depth up to 4 m for all programs. Frames are loaded in chunks of 40.",
              "The programs integrate each chunk in turn, several rounds, each round into a separate map. The time of a frame is that",
              "of its fastest round; a row is the mean over frames. The images and tensors of Open3D are prepared before the measurement;",
              "housemartin takes 16-bit depth and RGB as they are, with carving, colour (except for depth only) and the edge filter.",
              "Each benchmark is a separate process; `OMP_NUM_THREADS` and a limit for TBB give the peer the same number of threads.", "", "| row | what is measured |", "|---|---|"]
    lines += [f"| `{row.name}` | {row.what} |" for row in rows.ROWS]
    lines += ["", kernel_section(stored["details"].get("kernel_limit")), "## Everything else that was measured", "", "```json",
              json.dumps({key: value for key, value in stored["details"].items() if key != "kernel_limit"}, indent=1), "```", ""]
    return "\n".join(lines)
