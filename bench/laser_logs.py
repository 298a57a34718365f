"""Laser logs of real buildings, as they are and thinned, from scans alone."""
from pathlib import Path

import recordings
from verdicts import run_hm


def thinned(log, every, out):
    """Writes a log with every n-th scan of it."""
    kept = []
    count = -1
    for line in Path(log).read_text(encoding="utf-8").splitlines():
        word = line.split(" ", 1)[0]
        count += word == "VERTEX2"
        if word in ("VERTEX2", "ROBOTLASER1") and count % every == 0:
            kept.append(line)
    out.write_text("\n".join(kept) + "\n", encoding="utf-8")
    return out


def without_odometry(program, data, work):
    """(rows, details) of bench/run."""
    details = {}
    for name in recordings.needed("laser_no_odometry"):
        for every in (1, 2):
            log = thinned(data / name, every, Path(work) / Path(name).name)
            run = run_hm(program, "laser", log, "-o", Path(work) / "out", "--overwrite", "--set", "laser.pictures=false")
            details[f"{name} every {every}"] = {"ate_m": run["ate_rmse_m"], "verdict": run["verdict"]["value"],
                                               "match_ms": run["match_ms"]["mean"], "loops": run["loops"]["accepted"]}
    worst = max((run["ate_m"] for run in details.values() if run["verdict"] == "ok"), default=0.0)
    return [{"name": "laser_no_odometry", "ours": worst, "peer": None}], details
