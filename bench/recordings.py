"""The split of the recordings (recordings.json): which part may choose constants, which judges, and what each bench judges."""
import json
from pathlib import Path

PARTS = ("tuning", "judging", "whole")
DECLARED = json.loads((Path(__file__).parent / "recordings.json").read_text(encoding="utf-8"))
SPLITS = {name: entry["split_s"] for name, entry in DECLARED["recordings"].items()}
BENCHES = DECLARED["benches"]


def needed(bench):
    """The recordings without which a bench cannot run."""
    return BENCHES.get(bench, {}).get("needs", [])


def used(bench, folder=""):
    """All recordings of a bench in a folder of the data, those that it can do without included."""
    entry = BENCHES.get(bench, {})
    return [name for name in entry.get("needs", []) + entry.get("uses", []) if name.startswith(folder)]


def seeds(simulation, part):
    """The seeds of a simulation that may choose constants ("tuning") or that judge ("judging")."""
    return DECLARED["simulations"][simulation][f"{part}_seeds"]


def part_judged(bench):
    """What the rows of a bench judge: a part of recordings, or simulation where it uses none."""
    return BENCHES[bench]["part"] if bench in BENCHES else "simulation"


def laser_part(recording, part):
    """Options of `hm laser` for a part of a recording."""
    begin, duration = {"tuning": (0, SPLITS[recording]), "judging": (SPLITS[recording], 0), "whole": (0, 0)}[part]
    return ["--set", f"laser.begin_s={begin}", "--set", f"laser.duration_s={duration}"]
