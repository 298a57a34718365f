"""A vehicle that is flown from the page in a browser while a mesh fills the line: from a press of the button to the autopilot."""
import random
import re
import subprocess
import threading
import time
from pathlib import Path

import page_figures
import page_support
from pilot_rows import Flight

LINE = 1_000_000  # bytes a second
PRESSES = 300
NEVER_S = 2
HOLD = 3  # CommandKind
BUTTON = "[...document.querySelectorAll('#panel button')].find(b => b.textContent.trim() === 'Hold')"
# The times at which the browser got the input, s since 1970.
WATCH = f"""window.presses = [];
  window.addEventListener('click', event => {{ if (event.target === {BUTTON}) presses.push((performance.timeOrigin + event.timeStamp) / 1000); }}, {{capture: true}});
  {BUTTON}.scrollIntoView({{block: 'center'}});
  const box = {BUTTON}.getBoundingClientRect();
  return [box.x + box.width / 2, box.y + box.height / 2];"""
ANSWERED = "[...document.querySelectorAll('#panel dt')].find(t => t.textContent === 'button to answer')?.nextSibling.textContent"


class Commands(threading.Thread):
    """When holds reached the autopilot, s since 1970."""

    def __init__(self, stream):
        super().__init__(daemon=True)
        self.stream, self.times = stream, []
        self.start()

    def run(self):
        for line in self.stream:
            if (found := re.match(r"command (\d+) ([\d.]+)", line)) and int(found[1]) == HOLD:
                self.times.append(float(found[2]))


def press(driver, x, y):
    for kind in ("mousePressed", "mouseReleased"):
        driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": kind, "x": x, "y": y, "button": "left", "clickCount": 1})


def latencies(flight, commands, presses):
    """Seconds from each press to the autopilot, one after the other; to the answer on the page as it says, ms."""
    x, y = flight.driver.execute_script(WATCH)
    delays, answered = [], []
    for number in range(presses):
        time.sleep(random.uniform(0.1, 0.3))
        before = len(commands.times)
        press(flight.driver, x, y)
        end = time.monotonic() + NEVER_S
        while len(commands.times) == before and time.monotonic() < end:
            time.sleep(0.005)
        pressed = flight.driver.execute_script("return presses")
        if len(pressed) != number + 1:
            raise RuntimeError("the button was not pressed")
        delays.append(commands.times[before] - pressed[-1] if len(commands.times) > before else float(NEVER_S))
        if found := re.match(r"([\d.]+) ms", flight.driver.execute_script(f"return {ANSWERED}") or ""):
            answered.append(float(found[1]))
    return delays, answered


def simulated_house(program, work):
    for words in (["simulate", "house", "-o", work / "house", "--quiet", "--frames", 300],
                  ["reconstruct", work / "house", "-o", work / "result", "--voxel", 0.03, "--quiet"]):
        subprocess.run([str(program), *map(str, words)], check=True, capture_output=True)
    return work / "result" / "mesh.ply"


def measure(programs, work, presses=0, bytes_per_s=LINE):
    """(measured rows, details), or a reason why there are none."""
    if wrong := page_support.missing():
        return None, wrong
    work = Path(work)
    mesh = simulated_house(programs / "hm", work)
    flight = Flight([programs / "hm_pilot_stand", mesh, work / "flown"], bytes_per_s, subprocess.PIPE)
    try:
        commands = Commands(flight.process.stdout)
        flight.enter()
        carried, start = flight.line.down.carried if flight.line.down else 0, time.monotonic()
        delays, answered = latencies(flight, commands, presses or PRESSES)
        share = (flight.line.down.carried - carried) / (time.monotonic() - start) / bytes_per_s if flight.line.down else None
    finally:
        flight.close()
    ms = {f"p{round(100 * part)}": 1000 * page_figures.percentile(delays, part) for part in (0.5, 0.9, 0.99)}
    return [{"name": "pilot_latency", "ours": ms["p99"], "peer": None}], {
        "presses": len(delays), "delay_ms": ms, "worst_ms": 1000 * max(delays), "least_ms": 1000 * min(delays), "never": sum(delay >= NEVER_S for delay in delays),
        "line_share": share, "answer_ms": {f"p{round(100 * part)}": page_figures.percentile(answered, part) for part in (0.5, 0.99)}}


if __name__ == "__main__":
    import json
    import sys
    import tempfile
    with tempfile.TemporaryDirectory() as folder:
        print(json.dumps(measure(Path(sys.argv[1]), folder, *map(int, sys.argv[2:])), indent=1))
