"""Laser SLAM in simulated office floors: errors over seeds, and whether the verdict admits the large ones."""
from pathlib import Path

import recordings
from verdicts import run_hm, worst_ok


def percentile(values, share):
    """The value that this share of them does not exceed; of the sorted values, without interpolation."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def drive(program, seed, work, every=1, scan_every_m=1):
    """One floor, of every second seed a large one: what `hm laser` makes of every n-th scan of it."""
    work = Path(work) / str(seed)
    large = seed % 2 == 0
    run_hm(program, "simulate", "office", "--seed", seed, "--scan-every", scan_every_m, "-o", work / "office", *(["--large"] if large else []))
    run = run_hm(program, "laser", work / "office", "-o", work / "out", "--set", "laser.pictures=false",
                 "--set", f"laser.scan_stride={every}")
    return {"seed": seed, "large": large, "wrong_loops": run["loops"]["wrong"] or 0, "ate_m": run["ate_rmse_m"], "ate_odom_m": run.get("ate_rmse_odom_m", run["ate_rmse_m"]),
            "verdict": run["verdict"]["value"], "loops": run["loops"]["accepted"] - run["loops"]["removed"],
            "unconfirmed": run["scans"]["unconfirmed"], "scans": run["scans"]["total"], "match_ms": run["match_ms"]["mean"],
            "pieces": len(run["pieces"])}


def median_and_ok(name, ok_name, runs):
    """(rows, details) of bench/run: the median error of these floors, and the largest of one that is called ok."""
    values = {name: percentile([run["ate_m"] for run in runs], 0.5), ok_name: worst_ok(runs)}
    return [{"name": key, "ours": value, "peer": None} for key, value in values.items()], {"runs": runs}


def at_half_rate(program, work, part="judging"):
    """(rows, details) of bench/run: every second scan of the floors."""
    runs = [drive(program, seed, work, every=2) for seed in recordings.seeds("office", part)]
    return median_and_ok("laser_half_rate_office", "laser_half_rate_ok", runs)


def often(program, work, part="judging"):
    """(rows, details) of bench/run: the small floors, scanned every 2.5 cm."""
    runs = [drive(program, seed, work, scan_every_m=0.025) for seed in recordings.seeds("office", part) if seed % 2 == 1]
    return median_and_ok("laser_office_often", "laser_office_often_ok", runs)


def offices(program, work, part="judging"):
    """(rows, details) of bench/run; the seeds are those of recordings.json for this part."""
    runs = [drive(program, seed, work) for seed in recordings.seeds("office", part)]
    errors = [run["ate_m"] for run in runs]
    loops, wrong = (sum(run[key] for run in runs) for key in ("loops", "wrong_loops"))
    values = {"laser_office": percentile(errors, 0.5), "laser_office_worst": max(errors),
              "laser_office_loops": 100 * (1 - wrong / max(1, loops)), "laser_office_ok": worst_ok(runs)}
    matching = [run["ate_odom_m"] for run in runs]
    details = {"ate_m": {"median": percentile(errors, 0.5), "p90": percentile(errors, 0.9), "worst": max(errors)},
               "ate_odom_m": {"median": percentile(matching, 0.5), "p90": percentile(matching, 0.9), "worst": max(matching)},
               "runs": runs}
    return [{"name": name, "ours": value, "peer": None} for name, value in values.items()], details


if __name__ == "__main__":
    import json
    import sys
    import tempfile
    with tempfile.TemporaryDirectory(prefix="hm_bench_") as folder:
        print(json.dumps(offices(sys.argv[1], folder, sys.argv[2]), indent=1))
