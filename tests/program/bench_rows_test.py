"""bench/run knows every row of the table, and judges them as it says. Nothing is timed."""
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "bench"))
import rows  # noqa: E402

WANTED = """open3d_scalable open3d_voxelblock simd threads carving mesh_incremental mesh_whole map_memory tango house_memory steady
accuracy fidelity completeness seams plicp_1081 plicp_bag plicp_ablation plicp_still height late_laser mvog_memory mvog_update mvog_holdout mvog_query""".split()


def run(*words):
    return subprocess.run([ROOT / "bench" / "run", *words], capture_output=True, text=True, check=False)


listed = run("--list")
assert listed.returncode == 0 and set(WANTED) <= set(listed.stdout.split()), listed
assert run("no_such_row").returncode == 2

by_name = {row.name: row for row in rows.ROWS}
assert len(by_name) == len(rows.ROWS)
fast = rows.judged(by_name["open3d_scalable"], 1.0, 5.5)
assert fast["ratio"] == 5.5 and fast["holds"] is True
slow_depth = rows.judged(by_name["open3d_scalable_depth"], 1.0, 5.5)
assert slow_depth["holds"] is False
rows.combine([fast, slow_depth])
assert fast["holds"] is False, "a row holds only with its companions"
assert rows.judged(by_name["open3d_scalable"], 1.0, None)["holds"] is None
assert rows.judged(by_name["carving"], 1.2, None)["holds"] is False
assert rows.judged(by_name["completeness"], 97.5, None)["holds"] is True
assert rows.judged(by_name["fidelity_covered"], 98.9, 99.3)["holds"] is False
print("bench rows: good")
