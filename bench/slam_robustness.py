"""SLAM of recordings that are harder than they were: at half the rate, and with cameras that nobody registered or calibrated."""
import statistics
from pathlib import Path

import recordings
from slam_continue import QUIET
from verdicts import run_hm

BIASED = ("--set", "simulation.flaws=unregistered,short_depth,depth_bend", "--set", "simulation.imu=false", "--set", "simulation.frame_stride=3")


def run_of(program, recording, work, *options):
    run = run_hm(program, "slam", recording, "-o", Path(work) / "slam", *QUIET, *options)
    return {"ate_m": run["ate_rmse_m"], "odometry_ate_m": run["odometry"]["ate_rmse_m"], "lost": run["frames"]["lost"],
            "verdict": run["verdict"]["value"], "loops": run["loops"]["accepted"]}


def at_half_rate(program, data, work):
    """(rows, details) of bench/run: every RGB-D recording, and every second frame of it."""
    details = {name: {rate: run_of(program, data / name, work, "--set", f"reconstruction.frame_stride={stride}")
                      for rate, stride in (("whole", 1), ("half", 2))}
               for name in recordings.used("half_rate") if (data / name).exists()}
    return [{"name": "half_rate", "ours": max(runs["half"]["ate_m"] / runs["whole"]["ate_m"] for runs in details.values()), "peer": None},
            {"name": "half_rate_lost", "ours": sum(runs["half"]["lost"] for runs in details.values()), "peer": None}], details


def biased(program, work, part="judging"):
    """(rows, details) of bench/run: a room seen by cameras that nobody registered or calibrated; after loops against odometry."""
    runs = []
    for seed in recordings.seeds("biased_room", part):
        recording = Path(work) / f"room_{seed}"
        run_hm(program, "simulate", "room", "--sensor", "kinect", "--seed", seed, "-o", recording, *BIASED)
        runs.append({"seed": seed, **run_of(program, recording, work)})
    ratios = [run["ate_m"] / run["odometry_ate_m"] for run in runs]
    return [{"name": "slam_biased", "ours": statistics.median(ratios), "peer": None},
            {"name": "slam_biased_worst", "ours": max(ratios), "peer": None}], {"runs": runs}
