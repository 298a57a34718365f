"""SLAM of walks through the simulated house as a real camera records them (hm simulate --realistic), over seeds."""
import statistics
import struct
from pathlib import Path

import recordings
from verdicts import run_hm

SENSOR, STRIDE, FRAMES = "kinect", 3, 900  # 10 Hz, a minute and a half: the hall and rooms on both sides of it
VOXEL = ("--voxel", "0.02")
QUIET = ("--overwrite", "--set", "reconstruction.pictures=false")
# The sizes of a PLY's numbers.
PLY_BYTES = {"float": 4, "double": 8, "uchar": 1, "char": 1, "ushort": 2, "short": 2, "uint": 4, "int": 4}


def rows_of(path):
    """Positions of a TUM trajectory by stamp."""
    lines = (line.split() for line in Path(path).read_text(encoding="utf-8").splitlines() if line and line[0] != "#")
    return {round(float(line[0]), 4): tuple(map(float, line[1:4])) for line in lines}


def mean(points):
    return [sum(p[i] for p in points) / len(points) for i in range(3)]


def rotated(q, v):
    """v turned by the unit quaternion q = (w, x, y, z)."""
    w, u = q[0], q[1:]
    c = (u[1] * v[2] - u[2] * v[1] + w * v[0], u[2] * v[0] - u[0] * v[2] + w * v[1], u[0] * v[1] - u[1] * v[0] + w * v[2])
    return (v[0] + 2 * (u[1] * c[2] - u[2] * c[1]), v[1] + 2 * (u[2] * c[0] - u[0] * c[2]), v[2] + 2 * (u[0] * c[1] - u[1] * c[0]))


def aligned(found, true):
    """(quaternion, shift) that moves the positions `found` onto `true`, by stamp, with the least squared distance (Horn 1987)."""
    stamps = sorted(found.keys() & true.keys())
    a, b = [found[s] for s in stamps], [true[s] for s in stamps]
    mean_a, mean_b = mean(a), mean(b)
    s = [[sum((p[i] - mean_a[i]) * (q[j] - mean_b[j]) for p, q in zip(a, b)) for j in range(3)] for i in range(3)]
    trace = s[0][0] + s[1][1] + s[2][2]
    skew = (s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0])
    n = [[trace, *skew]] + [[skew[i]] + [s[i][j] + s[j][i] - (trace if i == j else 0) for j in range(3)] for i in range(3)]
    shift = 1 + 2 * max(sum(abs(x) for x in row) for row in n)  # makes the largest eigenvalue the one of largest magnitude
    q = [1.0, 0.1, 0.1, 0.1]
    for _ in range(20000):
        q = [shift * q[i] + sum(n[i][j] * q[j] for j in range(4)) for i in range(4)]
        length = sum(x * x for x in q) ** 0.5
        q = [x / length for x in q]
    moved = rotated(q, mean_a)
    return q, [mean_b[i] - moved[i] for i in range(3)]


def moved_mesh(source, target, q, shift):
    """Writes a binary PLY anew, its vertices moved."""
    data = bytearray(Path(source).read_bytes())
    header = data[:data.index(b"end_header\n")].decode().split("\n")
    begin = data.index(b"end_header\n") + len(b"end_header\n")
    at = next(i for i, line in enumerate(header) if line.startswith("element vertex"))
    properties = []
    for line in header[at + 1:]:
        if not line.startswith("property"):
            break
        properties.append(line.split()[1:])
    assert [p[:2] for p in properties[:3]] == [["float", name] for name in "xyz"] and "format binary_little_endian 1.0" in header
    size = sum(PLY_BYTES[kind] for kind, _ in properties)
    for i in range(int(header[at].split()[2])):
        p = rotated(q, struct.unpack_from("<3f", data, begin + i * size))
        struct.pack_into("<3f", data, begin + i * size, *(p[k] + shift[k] for k in range(3)))
    Path(target).write_bytes(data)


def surface_error_mm(program, mesh, recording):
    return run_hm(program, "evaluate", "mesh", mesh, recording / "truth_mesh.ply", "--set", "mesh_error.samples=300000")["accuracy_mm"]["mean"]


def walk(program, seed, work, frames=FRAMES):
    """One walk: what `hm slam` makes of it, its mesh against that of the true poses."""
    work = Path(work) / str(seed)
    recording = work / "house"
    if not recording.exists():
        run_hm(program, "simulate", "house", "--sensor", SENSOR, "--realistic", "--seed", seed, "--frames", frames, "-o", recording,
               "--set", f"simulation.frame_stride={STRIDE}")
    run = run_hm(program, "slam", recording, "-o", work / "slam", *VOXEL, *QUIET, "--set", "slam.matrices=false")
    run_hm(program, "reconstruct", recording, "-o", work / "true", "--poses", recording / "groundtruth.txt", *VOXEL, *QUIET)
    moved_mesh(work / "slam" / "mesh.ply", work / "moved.ply",
               *aligned(rows_of(work / "slam" / "trajectory.tum"), rows_of(recording / "groundtruth.txt")))
    found, best = surface_error_mm(program, work / "moved.ply", recording), surface_error_mm(program, work / "true" / "mesh.ply", recording)
    return {"seed": seed, "ate_m": run["ate_rmse_m"], "odometry_ate_m": run["odometry"]["ate_rmse_m"], "mesh_mm": found, "mesh_of_truth_mm": best,
            "verdict": run["verdict"]["value"], "frames": run["frames"], "loops": run["loops"]}


def walks(program, work, frames=0, part="judging"):
    """(rows, details) of bench/run; the seeds are those of recordings.json for this part."""
    runs = [walk(program, seed, work, frames or FRAMES) for seed in recordings.seeds("real_house", part)]
    ours, odometry = [100 * run["ate_m"] for run in runs], [100 * run["odometry_ate_m"] for run in runs]
    meshes = [run["mesh_mm"] / run["mesh_of_truth_mm"] for run in runs]
    rows = [{"name": "slam_house_real", "ours": statistics.median(ours), "peer": statistics.median(odometry)},
            {"name": "slam_house_real_worst", "ours": max(ours), "peer": max(odometry)},
            {"name": "slam_house_real_mesh", "ours": statistics.median(meshes), "peer": None}]
    return rows, {"walk_s": STRIDE * (frames or FRAMES) / 30, "runs": runs}


if __name__ == "__main__":
    import json
    import sys
    print(json.dumps(walks(sys.argv[1], sys.argv[2], part=sys.argv[3]), indent=1))
