"""Judges the verdict of runs (docs/verdict.md) on good and on damaged results, simulated and real: how many that are torn
are called ok, how many that are good are called broken or doubtful."""
import json
import subprocess
import sys
from pathlib import Path

import recordings

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "program"))

from bent_poses import bent, read_rows  # noqa: E402

# Shares of the noise of wheel odometry (wheel_noise.strength): the poses of a laser map, uncorrected.
NOISE_SHARES = (0, 0.005, 0.01, 0.1, 0.3, 1)
# Errors of laser maps between the two are neither good nor torn, and are not judged.
LASER_GOOD_M, LASER_TORN_M = 0.1, 0.5
# Bends of a camera's path, from a share of it on: turn about an axis through the camera (degrees), shift (m).
GOOD_BENDS = ((0, 0), (0.15, 0.002), (0.3, 0.005))
TORN_BENDS = ((6, 0), (10, 0), (0, 0.25), (0, 0.5), (8, 0.2))
BEND_AT = (0.3, 0.5, 0.7)


def run_hm(program, *words):
    done = subprocess.run([program, *map(str, words), "--quiet", "--json"], capture_output=True, text=True, check=False)
    document = json.loads(done.stdout)
    if not document["ok"]:
        raise RuntimeError(f"hm {' '.join(map(str, words))}: {document['error']['message']}")
    return document


def worst_ok(runs):
    """Largest error of a result called ok; 0 where none is."""
    return max((run["ate_m"] for run in runs if run["verdict"] == "ok"), default=0.0)


def laser_cases(program, recording, seeds, work):
    """("good" or "torn", verdict) for maps from damaged odometry, by their error."""
    for share in NOISE_SHARES:
        for seed in seeds if share else seeds[:1]:
            run = run_hm(program, "laser", recording, "-o", work / "laser", "--overwrite", "--set", "laser.poses=odometry", "--set",
                         "laser.degraded_odometry=true", "--set", f"wheel_noise.seed={seed}", "--set", f"wheel_noise.strength={share}")
            if run["ate_rmse_m"] <= LASER_GOOD_M:
                yield "good", run["verdict"]["value"]
            elif run["ate_rmse_m"] >= LASER_TORN_M:
                yield "torn", run["verdict"]["value"]


def rgbd_cases(program, recording, work):
    """The same for maps from bent poses, by the bend."""
    path = work / "poses.tum"
    run_hm(program, "reconstruct", recording, "-o", work / "given", "--overwrite")
    rows = read_rows(work / "given" / "trajectory.tum")
    for name, bends in (("good", GOOD_BENDS), ("torn", TORN_BENDS)):
        for k, (turn, shift) in enumerate(bends):
            for share in BEND_AT:
                for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
                    path.write_text(bent(rows, share, turn, shift, axis))
                    run = run_hm(program, "reconstruct", recording, "-o", work / "bent", "--overwrite", "--poses", path,
                                 "--set", "reconstruction.frame_stride=3", "--set", "reconstruction.pictures=false")
                    yield name, run["verdict"]["value"], f"{name} {k} {share} {axis} {run['verdict'].get('visits')}"


def percent(verdicts, *values):
    return 100 * sum(verdict in values for verdict in verdicts) / max(1, len(verdicts))


def judge(program, data, work, say=lambda text: None):
    """(rows, details) of bench/run."""
    work = Path(work)
    verdicts = {"good": [], "torn": []}

    def take(source, cases):
        for kind, verdict, *more in cases:
            verdicts[kind].append(verdict)
            if (kind == "torn") == (verdict == "ok"):
                say(f"{source}: {kind}, {verdict} {more}")

    for seed in (1, 2, 3):
        flight = work / f"flight_{seed}"
        run_hm(program, "simulate", "house", "--sensor", "laser_mav", "--frames", 2000, "--seed", seed, "-o", flight)
        take(flight.name, laser_cases(program, flight, range(1, 4), work))
    run_hm(program, "simulate", "room", "-o", work / "room")
    take("room", rgbd_cases(program, work / "room", work))
    for name in recordings.used("verdicts", "laser"):
        if (data / name).exists():
            take(name, laser_cases(program, data / name, range(1, 11), work))
    for name in recordings.used("verdicts", "rgbd"):
        if (data / name).exists():
            take(name, rgbd_cases(program, data / name, work))
    good, torn = verdicts["good"], verdicts["torn"]
    values = {"verdict": percent(torn, "ok"), "verdict_broken": percent(good, "broken"),
              "verdict_doubtful": percent(good, "doubtful")}
    return ([{"name": name, "ours": value, "peer": None} for name, value in values.items()],
            {"good": len(good), "torn": len(torn)})
