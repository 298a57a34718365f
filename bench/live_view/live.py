"""`hm scan` on replays: a walk through the simulated house, VGA at 30 Hz for a minute, then unplugged; a real recording to its end."""
import json
import subprocess

SECONDS = 60


def run(program, *words):
    done = subprocess.run([program, *words, "--json", "--quiet"], capture_output=True, text=True, check=False)
    return json.loads(done.stdout)


def scan(program, folder, frames):
    """(measured rows, details)."""
    count = frames or 30 * (SECONDS + 2)
    run(program, "simulate", "house", "-o", f"{folder}/house", "--sensor", "kinect", "--frames", str(count))
    unplug_s = min(SECONDS, count / 30 - 1)
    result = run(program, "scan", "--camera", f"replay:{folder}/house", "-o", f"{folder}/scanned", "--unplug-after",
                 f"{unplug_s:g}")
    capture = result["capture"]
    kept = capture["tracked"] + capture["lost"] + capture["unusable"]
    recorded = capture["recorded"] + capture["not_recorded"]
    usable = kept + capture["dropped"]["queue_full"]
    uncounted = abs(capture["captured"] - kept - capture["dropped"]["total"]) + abs(recorded - usable)
    values = {"live": capture["latency_ms"]["p99"], "live_uncounted": uncounted, "live_unplugged": capture["saved_s"]}
    details = {key: capture[key] for key in ("captured", "tracked", "mapped", "lost", "dropped", "recorded", "recorded_uncompressed",
                                             "not_recorded", "rate_hz", "latency_ms")}
    return [{"name": name, "ours": value, "peer": None} for name, value in values.items()], details


def at_its_own_pace(program, data, folder):
    """(measured rows, details): a real VGA recording at 30 Hz, tracked, its loops closed and mapped while it lasts."""
    result = run(program, "scan", "--camera", f"replay:{data / 'rgbd' / 'sevenscenes_a'}", "-o", f"{folder}/scanned")
    capture = result["capture"]
    values = {"slam_realtime": capture["latency_ms"]["mean"], "slam_realtime_dropped": capture["dropped"]["total"],
              "slam_realtime_end": result["wall_s"] - capture["duration_s"]}
    details = {key: capture[key] for key in ("captured", "tracked", "mapped", "lost", "dropped", "rate_hz", "latency_ms")}
    return [{"name": name, "ours": value, "peer": None} for name, value in values.items()], details
