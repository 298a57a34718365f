"""Recordings that go on in the saved map of another (hm slam --continue)."""
from pathlib import Path

from verdicts import run_hm

QUIET = ("--overwrite", "--set", "reconstruction.pictures=false", "--set", "slam.matrices=false")


def pairs(data):
    """Name, recording of the map, recording that goes on in it; each with its own options."""
    half = ("--set", "reconstruction.frame_limit=300"), ("--set", "reconstruction.begin_frame=300")
    rooms = data / "rgbd" / "sevenscenes_a"
    return [("tum_fr1_rpy into tum_fr1_xyz", (data / "rgbd" / "tum_fr1_xyz",), (data / "rgbd" / "tum_fr1_rpy",)),
            ("second half of sevenscenes_a into the first", (rooms, *half[0]), (rooms, *half[1]))]


def go_on(program, data, work):
    """(rows, details) of bench/run."""
    details = {}
    for name, first, second in pairs(data):
        alone = run_hm(program, "slam", *first, "-o", Path(work) / "map", *QUIET)
        run = run_hm(program, "slam", *second, "--continue", Path(work) / "map", "-o", Path(work) / "both", *QUIET)
        details[name] = {"ate_m": run["ate_rmse_m"], "odometry_ate_m": run["odometry"]["ate_rmse_m"], "map_ate_m": alone["ate_rmse_m"],
                         "recognised_at_s": run["continued"]["recognised_at_s"], "loops": run["continued"]["loops"]}
    worst = max(details.values(), key=lambda run: run["ate_m"])
    return [{"name": "slam_continue", "ours": 100 * worst["ate_m"], "peer": 100 * worst["odometry_ate_m"]}], details
