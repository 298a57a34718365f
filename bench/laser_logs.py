"""Laser logs of real buildings: as they are and thinned, from scans alone; and against relations that people verified."""
import bisect
import statistics
from pathlib import Path

import recordings
from verdicts import run_hm, worst_ok

NEAR_S, EXACT_S = 0.02, 1e-5
SEEDS = (1, 2, 3, 4, 5)
LIVE_SCANS = 2400  # a minute


def scan_stamps(log):
    """Stamps of the scans of a log in CARMEN's text form, sorted."""
    lines = (line.split() for line in Path(log).read_text(encoding="utf-8").splitlines())
    return sorted(float(words[-3]) for words in lines if words and words[0] in ("FLASER", "ROBOTLASER1"))


def relations_at_scans(relations, log, out, near_s=NEAR_S, every=1):
    """Writes those relations whose both moments lie so near to an n-th scan of the log; how many they are."""
    stamps = scan_stamps(log)[::every]

    def is_at_scan(moment):
        place = bisect.bisect(stamps, moment)
        return any(abs(stamp - moment) <= near_s for stamp in stamps[max(0, place - 1):place + 1])

    kept = [line for line in Path(relations).read_text(encoding="utf-8").splitlines()
            if line.strip() and all(is_at_scan(float(word)) for word in line.split()[:2])]
    out.write_text("\n".join(kept) + "\n", encoding="utf-8")
    return len(kept)


def run_against(program, log, relations, work, *settings, near_s=NEAR_S, judged_every=1):
    """`hm laser` against the relations at scans, or at every n-th; poses are interpolated however far scans are apart."""
    kept = Path(work) / "kept.relations"
    count = relations_at_scans(relations, log, kept, near_s, judged_every)
    run = run_hm(program, "laser", log, "-o", Path(work) / "out", "--overwrite", "--relations", kept, "--set", "laser.pictures=false",
                 "--set", "relation_error.max_gap_s=1000", *settings)
    if run["relations"]["used"] != count:
        raise RuntimeError(f"{log}: {run['relations']['used']} of {count} relations could be judged")
    return {"mean_m": run["relation_error_m"]["mean"], "p95_m": run["relation_error_m"]["p95"], "relations": count,
            "odom_mean_m": run.get("relation_error_odom_m", {}).get("mean"), "verdict": run["verdict"]["value"],
            "loops": run["loops"]["accepted"] - run["loops"]["removed"]}


def against_relations(program, data, work):
    """(rows, details) of bench/run."""
    folder = data / "laser"
    degraded = [run_against(program, folder / "flirt_fr079.log", folder / "fr079.relations", work, "--set", "laser.degraded_odometry=true",
                            "--set", f"wheel_noise.seed={seed}") for seed in SEEDS]
    wheels, exact = (run_against(program, folder / "intel_wheel_odometry.log", folder / "intel.relations", work, near_s=near_s)
                     for near_s in (NEAR_S, EXACT_S))
    values = {"laser_fr079": statistics.median(run["mean_m"] for run in degraded),
              "laser_fr079_p95": statistics.median(run["p95_m"] for run in degraded), "laser_intel_wheel": wheels["mean_m"],
              "laser_intel_wheel_exact": exact["mean_m"]}
    return ([{"name": name, "ours": value, "peer": None} for name, value in values.items()],
            {"fr079": degraded, "intel_wheel": wheels, "intel_wheel_exact": exact})


def at_half_rate(program, data, work):
    """(rows, details) of bench/run: mean errors with every second scan and with all, against the relations at every second."""
    folder = data / "laser"
    details = {name: {rate: run_against(program, folder / log, folder / relations, work, *settings, "--set", f"laser.scan_stride={stride}",
                                        judged_every=2) for rate, stride in (("whole", 1), ("half", 2))}
               for name, log, relations, settings in (
                   ("fr079", "flirt_fr079.log", "fr079.relations", ("--set", "laser.degraded_odometry=true")),
                   ("intel_wheel", "intel_wheel_odometry.log", "intel.relations", ()))}
    ratio = max(runs["half"]["mean_m"] / runs["whole"]["mean_m"] for runs in details.values())
    return [{"name": "laser_half_rate", "ours": ratio, "peer": None}], details


def times_of(run):
    return {key: run[key] for key in ("scan_ms", "match_ms", "insert_ms", "loops", "scans", "run_s")}


def scan_time(program, data, work):
    """(rows, details) of bench/run: what a scan takes, loops and the solutions of the graph in it."""
    run = run_hm(program, "laser", data / "laser" / "intel_wheel_odometry.log", "-o", Path(work) / "out", "--set", "laser.pictures=false")
    return [{"name": "laser_time", "ours": run["scan_ms"]["mean"], "peer": None}], times_of(run)


def live_scan_time(program, work):
    """(rows, details) of bench/run: a flight at its own pace, loops on a thread of their own."""
    flight = Path(work) / "flight"
    run_hm(program, "simulate", "house", "--sensor", "laser_mav", "--frames", LIVE_SCANS, "-o", flight)
    run = run_hm(program, "laser", flight, "-o", Path(work) / "out", "--pace", "realtime", "--set", "laser.pictures=false")
    return ([{"name": "laser_time_p99", "ours": run["scan_ms"]["p99"], "peer": None},
             {"name": "laser_time_dropped", "ours": run["scans"]["dropped"], "peer": None}], times_of(run))


def without_odometry(program, data, work):
    """(rows, details) of bench/run."""
    details = {}
    for name in recordings.needed("laser_no_odometry"):
        for every in (1, 2):
            run = run_hm(program, "laser", data / name, "-o", Path(work) / "out", "--overwrite", "--set", "laser.pictures=false",
                         "--set", f"laser.scan_stride={every}")
            details[f"{name} every {every}"] = {"ate_m": run["ate_rmse_m"], "verdict": run["verdict"]["value"],
                                               "match_ms": run["match_ms"]["mean"], "loops": run["loops"]["accepted"]}
    return [{"name": "laser_no_odometry", "ours": worst_ok(details.values()), "peer": None}], details
