#!/usr/bin/env python3
"""Figures of the page in a browser that draws by software, with the model of a server that runs.

    bench/live_view/page_figures.py URL [--small URL]     prints JSON; needs chromium, chromium-driver and python3-selenium

A picture of a whole house takes seconds where software draws it. What a machine with graphics sees is measured with every draw call
cut to no triangles: all calls are made, all pages are decoded and copied, but the software has nothing to draw.
"""
import argparse
import json
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent.parent / "tests/page"))
import page_support as page  # noqa: E402

VIEW = page.VIEW
ORBIT_S = 10
# Turns the model a little before each picture and keeps the time from the picture's call to its end.
ORBIT = """const [seconds, done] = arguments, view = %s, tasks = [];
  housemartin.stage.moved = true;
  view.fit();
  const observer = new PerformanceObserver(list => tasks.push(...list.getEntries().map(e => e.duration)));
  observer.observe({type: 'longtask'});
  view.scriptMs.length = 0;
  const first = view.frames, start = performance.now(), old = view.onFrame;
  view.onFrame = dt => { old(dt); view.rig.turn(3, 0); return true; };
  setTimeout(() => {
    view.onFrame = old;
    observer.disconnect();
    done({script_ms: view.scriptMs.slice(), frames: view.frames - first, seconds: (performance.now() - start) / 1000, tasks});
  }, 1000 * seconds);""" % VIEW


NO_TRIANGLES = """{
  const cut = (prototype, name, change) => {
    const draw = prototype[name];
    prototype[name] = function(mode, ...rest) { draw.call(this, mode, ...change(rest)); };
  };
  const prototype = WebGL2RenderingContext.prototype, extension = prototype.getExtension;
  for (const name of ['drawElements', 'drawElementsInstanced']) cut(prototype, name, ([, ...rest]) => [0, ...rest]);
  for (const name of ['drawArrays', 'drawArraysInstanced']) cut(prototype, name, ([first, , ...rest]) => [first, 0, ...rest]);
  prototype.getExtension = function(name) {
    const found = extension.call(this, name);
    if (found && name === 'WEBGL_multi_draw') cut(Object.getPrototypeOf(found), 'multiDrawElementsWEBGL', ([counts, ...rest]) => [new Int32Array(counts.length), ...rest]);
    return found;
  };
}"""


def open_browser(size, draws=True):
    driver = page.open_browser(size)
    driver.execute_cdp_cmd("Performance.enable", {"timeDomain": "threadTicks"})  # time on the processor, not on the clock
    if not draws:
        driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": NO_TRIANGLES})
    return driver


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(int(share * len(ordered)), len(ordered) - 1)] if ordered else None


def renderers(driver):
    """Processes of the tabs below the driver."""
    parents, kinds = {}, {}
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
                parents[int(folder.name)], kinds[int(folder.name)] = int(fields[1]), (folder / "cmdline").read_text()
            except OSError:
                continue
    ours = {driver.service.process.pid}
    for _ in range(8):
        ours |= {number for number, parent in parents.items() if parent in ours}
    return [number for number in ours if "--type=renderer" in kinds.get(number, "")]


def renderer_bytes(driver):
    """Proportional memory of the tab's process: the largest renderer below the driver."""
    size = 0
    for number in renderers(driver):
        lines = Path(f"/proc/{number}/smaps_rollup").read_text().splitlines()
        size = max(size, next(1024 * int(line.split()[1]) for line in lines if line.startswith("Pss:")))
    return size


def wait_until_whole(driver, seconds=300):
    """Until no page has come for two seconds; returns seconds since the start of the page, and to its first picture."""
    start, last, since, first = time.monotonic(), None, time.monotonic(), None
    while time.monotonic() - start < seconds:
        state = driver.execute_script(f"return window.housemartin?.stage ? [{VIEW}.mesh.pageCount, {VIEW}.mesh.triangleCount, performance.now(), {VIEW}.mesh.drawnPages] : null")
        if state and state[3] and first is None:
            first = state[2] / 1000
        if state != last and (last is None or state[:2] != last[:2]):
            last, since = state, time.monotonic()
        elif state and state[0] and time.monotonic() - since > 2:
            return last[2] / 1000, first
        time.sleep(0.05)
    raise SystemExit("the model was not whole in time")


def orbit(driver, seconds=ORBIT_S):
    driver.set_script_timeout(seconds + 60)
    before = metrics(driver)
    result = driver.execute_async_script(ORBIT, seconds)
    after = metrics(driver)
    result["script_cpu_ms"] = 1000 * (after["ScriptDuration"] - before["ScriptDuration"]) / max(result["frames"], 1)
    return result


def metrics(driver):
    return {entry["name"]: entry["value"] for entry in driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]}


def drawn(url, size):
    """With all that software draws."""
    driver = open_browser(size)
    try:
        driver.get(url)
        _, first_s = wait_until_whole(driver)
        bundle = driver.execute_script("return [...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')]"
                                       ".reduce((sum, entry) => sum + entry.encodedBodySize, 0)")
        turned = orbit(driver)
        return {"triangles": driver.execute_script(f"return {VIEW}.mesh.triangleCount"), "pages": driver.execute_script(f"return {VIEW}.mesh.pageCount"),
                "bundle_bytes": bundle, "first_picture_s": first_s, "frames_per_s": turned["frames"] / turned["seconds"],
                "drawn_triangles": driver.execute_script(f"return {VIEW}.mesh.drawnTriangles"), "memory_bytes": renderer_bytes(driver)}
    finally:
        driver.quit()


def cut(url, size):
    """With draw calls cut to no triangles."""
    driver = open_browser(size, draws=False)
    try:
        driver.get(url)
        whole_s, _ = wait_until_whole(driver)
        loading = driver.execute_script("return performance.getEntriesByType('longtask').map(e => e.duration)")
        turned = orbit(driver)
        return {"whole_s": whole_s, "script_ms_p50": percentile(turned["script_ms"], 0.5), "script_ms_p95": percentile(turned["script_ms"], 0.95),
                "script_cpu_ms": turned["script_cpu_ms"], "pictures": turned["frames"], "drawn_pages": driver.execute_script(f"return {VIEW}.mesh.drawnPages"),
                "long_tasks": [round(value) for value in turned["tasks"]], "long_tasks_loading": [round(value) for value in loading],
                "heap_bytes": metrics(driver)["JSHeapUsedSize"]}
    finally:
        driver.quit()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("url", help="of the model whose script time and memory are measured")
    parser.add_argument("--small", help="of a model of about 30,000 triangles: frames a second at 360 x 640")
    words = parser.parse_args()
    if reason := page.missing():
        raise SystemExit(reason)
    figures = {"drawn": drawn(words.url, page.DESK), "cut": cut(words.url, page.DESK)}
    if words.small:
        figures["small"] = drawn(words.small, (360, 640))
    print(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main()
