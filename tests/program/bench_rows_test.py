"""bench/run knows every row of the table, and judges them as it says. Nothing is timed."""
import json
import re
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "bench"))
sys.dont_write_bytecode = True
import recordings  # noqa: E402
import report  # noqa: E402
import rows  # noqa: E402
import slam_house_real  # noqa: E402

WANTED = """open3d_scalable open3d_voxelblock simd threads carving mesh_incremental mesh_whole map_memory tango house_memory steady
accuracy fidelity completeness seams plicp_1081 plicp_bag plicp_ablation plicp_still height late_laser mvog_memory mvog_update mvog_holdout mvog_query""".split()


def run(*words):
    return subprocess.run([ROOT / "bench" / "run", *words], capture_output=True, text=True, check=False)


listed = run("--list")
assert listed.returncode == 0 and set(WANTED) <= set(listed.stdout.split()), listed
for wrong in (["no_such_row"], ["--skip", "no_such_row"], ["--update", "no_such_row"], ["simd", "--skip", "threads"],
              ["--skip", "simd", "--update", "threads"]):
    assert run(*wrong).returncode == 2, wrong

by_name = {row.name: row for row in rows.ROWS}
assert len(by_name) == len(rows.ROWS)
fast = rows.judged(by_name["open3d_scalable"], 1.0, 5.5)
assert fast["ratio"] == 5.5 and fast["holds"] is True
drift, error = rows.judged(by_name["slam_house"], 0.5, None), rows.judged(by_name["slam_house_ate"], 6.0, 9.0)
assert drift["holds"] is True and error["holds"] is False
rows.combine([drift, error])
assert drift["holds"] is False, "a row holds only with its companions"
assert report.verdict(drift) == "holds only with slam_house_ate" and report.verdict(error) == "DOES NOT HOLD"
assert rows.judged(by_name["open3d_scalable"], 1.0, None)["holds"] is None
assert rows.judged(by_name["carving"], 1.2, None)["holds"] is False
assert rows.judged(by_name["completeness"], 97.5, None)["holds"] is True
for value, holds in ((0.79, False), (0.8, True), (1.3, True), (1.31, False)):
    assert rows.judged(by_name["covariance_used"], value, None)["holds"] is holds, value
assert report.number(by_name["covariance_used"].bar) == "0.8 to 1.3"

# What is measured: a row brings what it needs to hold; skipping one skips all that its bench measures.
benches, wanted = rows.benches_of(["slam_house"])
assert benches == [("slam_house", 2)] and wanted == ["slam_house", "slam_house_ate"], (benches, wanted)
benches, wanted = rows.benches_of([], ["mesh_from_slam", "vo_hour"])
assert "slam_house" not in dict(benches) and "slam_house_ate" not in wanted and "vo_hour" not in wanted
assert set(wanted) == {row.name for row in rows.ROWS if row.bench not in ("slam_house", "vo_hour")}
assert rows.benches_of([]) == (rows.benches_of(rows.NAMES)[0], rows.NAMES)

# Which rows --changed measures: those never measured, and those whose rooms differ from the commit of their measurement.
assert all(row.bench in rows.ROOMS for row in rows.ROWS)
for room in {room for rooms in rows.ROOMS.values() for room in rooms}:
    assert (ROOT / "src/hm" / room).is_dir(), room
asked = []
everything = {"rows": {name: {"commit": "aaaaaaa+"} for name in rows.NAMES if name != "simd"}}
changed = rows.changed_rows(everything, lambda commit, paths: asked.append((commit, paths)) or "src/hm/mvog" in paths)
assert changed == ["simd", *(row.name for row in rows.ROWS if "mvog" in rows.ROOMS[row.bench])], changed
assert ("aaaaaaa", ["src/hm/core", "src/hm/geometry", "src/hm/sensors", "src/hm/mvog"]) in asked
assert run("--changed", "simd").returncode == 2
assert [rows.table_of(name) for name in ("seams", "plicp_bag", "places")] == [
    "Dense reconstruction", "Laser", "RGB-D odometry and SLAM"]

# What was measured before stays, with its day and commit, and is judged by the bars of today.
day_one = {"date": "2026-01-02", "commit": "aaaaaaa", "machine": "old box", "load": 0.3}
day_two = {"date": "2026-02-03", "commit": "bbbbbbb+", "machine": "new box", "load": 1.5}
first = report.merged({"rows": {}, "details": {}}, {"simd": (1.0, 4.0), "carving": (1.04, None), "gone": (1.0, None)},
                      {"simd": {"a": 1}, "gone": {"b": 2}, "carving": {"c": 3}, "voxelblock_2": {"d": 4}}, day_one)
assert list(first["rows"]) == ["simd", "carving"], "in the table's order, without rows that there are no more"
assert first["details"] == {"simd": {"a": 1}, "carving": {"c": 3}, "voxelblock_2": {"d": 4}}
second = report.merged(first, {"carving": (1.2, None)}, {"carving": {"c": 5}}, day_two)
assert second["rows"]["simd"] == {"ours": 1.0, "peer": 4.0, **day_one}
assert second["rows"]["carving"] == {"ours": 1.2, "peer": None, **day_two}
assert second["details"]["carving"] == {"c": 5} and first["details"]["carving"] == {"c": 3}
everything = report.merged(second, {"open3d_scalable": (1.0, 6.0), "open3d_voxelblock": (1.0, 4.0), "map_memory": (10.0, 100.0)}, {}, day_one)
page = report.document(everything)
assert ("| `open3d_scalable` | 1 | 6 | 6 | 5 | 10 | ms a frame | holds only with open3d_voxelblock | "
        "`open3d_voxelblock` 4 times the peer (5; DOES NOT HOLD); `simd` 4 times the peer (3); "
        "`carving` 1.2 times the time without (1.1; DOES NOT HOLD; 2026-02-03 bbbbbbb+ on B) | whole | 2026-01-02 aaaaaaa |") in page, page
assert "| `map_memory` | 10 | 100 | 10 | 8 | 12 | MB | holds |  | whole | 2026-01-02 aaaaaaa |" in page, page

alone = report.document(second)
assert "| `simd` | 1 | 4 | 4 | 3 | 6 | ms a frame | holds |  | whole |" in alone, "a row whose line's own row is not measured has a line"

# Every row is in one line of the document, its own or that of the question that it belongs to.
in_lines = [name for table in rows.TABLES for line in rows.lines_of(table) for name in (line, *rows.companions(line))]
assert sorted(in_lines) == sorted(rows.NAMES), set(rows.NAMES) ^ set(in_lines)
assert len([line for table in rows.TABLES for line in rows.lines_of(table)]) <= 60
assert "4 rows: old box, load 0.3 to 0.3" in page and "1 rows: new box, load 1.5 to 1.5" in page
assert "Not measured: `threads`" in page and "`simd`" not in page[page.index("Not measured"):page.index("`measured`:")]
assert "## The integration kernel" not in page
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "stored.json"
    assert report.load(path) == {"rows": {}, "details": {}}
    path.write_text(json.dumps(second))
    assert report.load(path) == second
when = report.occasion(ROOT)
assert set(when) == {"date", "commit", "machine", "load"} and len(when["date"]) == 10 and when["commit"], when

# The parameters that benches set exist.
parameters = set(re.findall(r"^\| `([a-z_0-9]+\.[a-z_0-9]+)`", (ROOT / "docs" / "parameters.md").read_text(encoding="utf-8"), re.MULTILINE))
for script in [ROOT / "bench" / "run", *(ROOT / "bench").glob("*.py")]:
    for name in re.findall(r'"([a-z_]+\.[a-z_0-9]+)=', script.read_text(encoding="utf-8")):
        assert name in parameters, f"{script.name}: {name}"

# The document in the repository has the stored numbers.
stored = report.load(ROOT / "docs" / "benchmarks.json")
page = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
own_line = {name for table in rows.TABLES for name in rows.lines_of(table, stored["rows"])}
entries = [rows.judged(by_name[name], row["ours"], row["peer"]) for name, row in stored["rows"].items()]
rows.combine(entries)
for entry in entries:
    own = f"| `{entry['name']}` | {report.number(entry['ours'])} | {report.number(entry['peer'])} |"
    beside = report.beside(entry)[:-1]  # where and when may follow
    assert (own if entry["name"] in own_line else beside) in page, entry
print("bench rows: good")

# The split of the recordings: every bench of it exists, and every recording that a bench uses has a split.
assert set(recordings.BENCHES) <= {row.bench for row in rows.ROWS} | {"kernel_limit"}
for bench, entry in recordings.BENCHES.items():
    assert entry["part"] in recordings.PARTS and (recordings.used(bench) or entry["simulates"]), bench
    assert set(recordings.used(bench)) <= set(recordings.SPLITS), bench
    for simulation in entry.get("simulates", []):
        assert recordings.seeds(simulation, entry["part"]), bench
for simulation in recordings.DECLARED["simulations"]:
    assert not set(recordings.seeds(simulation, "tuning")) & set(recordings.seeds(simulation, "judging")), simulation
assert fast["judges"] == "whole" and drift["judges"] == "simulation"
assert recordings.laser_part("laser/flirt_fr079.log", "judging")[1] == f"laser.begin_s={recordings.SPLITS['laser/flirt_fr079.log']}"

# Meshes of slam_house_real are judged where the path lies: positions are moved onto each other, and a mesh with them.
half = 0.5 ** 0.5
turn, shift = (half, 0, 0, half), (1, 2, 3)  # a quarter about z
true = {stamp: (0.5 * stamp, stamp ** 2, 0.1 * stamp ** 3) for stamp in range(6)}
found = {stamp: (p[1] - 2, 1 - p[0], p[2] - 3) for stamp, p in true.items()} | {77: (9, 9, 9)}
quaternion, moved_by = slam_house_real.aligned(found, true)
assert all(abs(a - b) < 1e-9 for a, b in zip((*quaternion, *moved_by), (*turn, *shift))), (quaternion, moved_by)
with tempfile.TemporaryDirectory() as folder:
    mesh = Path(folder) / "mesh.ply"
    header = ("ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
              "property uchar red\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n").encode()
    mesh.write_bytes(header + struct.pack("<3fB3fB", 1, 0, 0, 7, 0, 1, 5, 8))
    slam_house_real.moved_mesh(mesh, mesh, quaternion, moved_by)
    data = mesh.read_bytes()
    assert data.startswith(header)
    vertices = struct.unpack("<3fB3fB", data[len(header):])
    assert all(abs(a - b) < 1e-6 for a, b in zip(vertices, (1, 3, 3, 7, 0, 2, 8, 8))), vertices
