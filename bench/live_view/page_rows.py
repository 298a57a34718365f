"""The live view's page and its server, with the demo's house: bytes on the line, times in a browser that draws by software."""
import contextlib
import re
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "tests" / "program"), str(ROOT / "tests" / "page")]
import page_figures  # noqa: E402
import page_measure  # noqa: E402
import page_support  # noqa: E402
from live_viewer import Viewer  # noqa: E402

SLOW = 1_000_000  # bytes a second
DEMO_VOXEL_M = 0.03
# Pictures are drawn by software: what is judged by the time of pictures is small.
SMALL = (360, 640)
LATENCY_S = 20
LATENCY = "housemartin.stage.view.latency"


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(map(str, words))}: {done.stderr[-500:]}")


@contextlib.contextmanager
def served(program, path):
    """The address of `hm serve` on a path."""
    words = [str(program), "serve", str(path), "--listen", "0"]
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        try:
            for line in process.stderr:
                if link := re.search(r"http://127\.0\.0\.1:\d+/", line):
                    yield link[0]
                    break
            else:
                raise RuntimeError(f"{' '.join(words)} said no address")
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate()


def port_of(url):
    return int(url.rsplit(":", 1)[1].strip("/"))


def missing(url):
    """Why there is no page to measure, or None."""
    try:
        urllib.request.urlopen(url + "page.js", timeout=30).close()
    except urllib.error.HTTPError:
        return "the program was built without the page (./hm builds it)"
    return page_support.missing()


def count_pages(url):
    """Pages of a finished model: those that have come when nothing has come for two seconds."""
    viewer = Viewer(port_of(url))
    viewer.socket.settimeout(2)
    with contextlib.suppress(TimeoutError):
        viewer.watch(lambda _: False, 120)
    viewer.close()
    return len(viewer.pages)


def until_whole(url, pages, bytes_per_s=0):
    """Seconds until a new viewer has all pages in some level, and in the finest."""
    viewer = Viewer(port_of(url), bytes_per_s)
    start = time.monotonic()
    if not viewer.watch(lambda v: len(v.pages) == pages, 120):
        raise RuntimeError("not all pages came")
    coarse_s = time.monotonic() - start
    if not viewer.watch(lambda v: all(level == 0 for _, level, _ in v.pages.values()), 120):
        raise RuntimeError("not all pages became fine")
    viewer.close()
    return coarse_s, time.monotonic() - start


def latencies(program, recording, draws):
    """Of a replayed scan that is watched: changes and poses until they are drawn, ms."""
    with served(program, recording) as url:
        driver = page_figures.open_browser(SMALL, draws)
        try:
            driver.get(url)
            page_support.wait_for(driver, f"window.housemartin?.stage?.view.mesh.pageCount > 0", 60)
            driver.execute_script(f"{LATENCY}.pages.length = {LATENCY}.poses.length = 0")
            time.sleep(LATENCY_S)
            return driver.execute_script(f"return {{pages: {LATENCY}.pages, poses: {LATENCY}.poses}}")
        finally:
            driver.quit()


def measure(program, work, frames):
    """(measured rows, details), or a reason why there are none."""
    work = Path(work)
    some = ["--frames", frames] if frames else []
    run(program, "simulate", "house", "-o", work / "house", "--quiet", *some)
    run(program, "reconstruct", work / "house", "-o", work / "result", "--voxel", DEMO_VOXEL_M, "--quiet")
    run(program, "simulate", "room", "-o", work / "room", "--quiet", "--frames", 10)
    run(program, "reconstruct", work / "room", "-o", work / "small", "--voxel", 0.025, "--quiet")
    run(program, "simulate", "room", "-o", work / "scan", "--quiet", "--frames", 200)
    with served(program, work / "result") as url:
        if wrong := missing(url):
            return None, wrong
        pages = count_pages(url)
        _, whole_s = until_whole(url, pages)
        coarse_s, slow_s = until_whole(url, pages, SLOW)
        sizes = page_measure.room_errors(url)
        drawn, cut = page_figures.drawn(url, page_support.DESK), page_figures.cut(url, page_support.DESK)
    with served(program, work / "small") as url:
        small = page_figures.drawn(url, SMALL)
    late, late_drawn = latencies(program, work / "scan", False), latencies(program, work / "scan", True)
    p95 = {name: {kind: page_figures.percentile(values, 0.95) for kind, values in kinds.items()} for name, kinds in (("cut", late), ("drawn", late_drawn))}
    values = {"page_whole": cut["whole_s"], "page_whole_viewer": whole_s, "page_whole_slow": slow_s, "page_coarse_slow": coarse_s,
              "page_script": cut["script_ms_p95"], "page_long_tasks": sum(ms > 50 for ms in cut["long_tasks"]),
              "page_frames": small["frames_per_s"], "page_memory": drawn["memory_bytes"] * 1e-6, "page_bundle": drawn["bundle_bytes"] * 1e-3,
              "page_first": drawn["first_picture_s"], "page_latency": p95["cut"]["pages"], "page_pose": p95["cut"]["poses"], "page_measure": 100 * page_measure.worst(sizes)}
    return [{"name": name, "ours": value, "peer": None} for name, value in values.items()], {
        "pages": pages, "drawn": drawn, "cut": cut, "small": small, "late_ms_p95": p95, "room_errors_m": sizes, "changes": len(late["pages"]), "poses": len(late["poses"])}
