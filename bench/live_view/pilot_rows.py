"""A vehicle that `hm fly` simulates, steered from the page in a browser that freezes, dies or loses its line: when does it hold?"""
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "tests" / "program"), str(ROOT / "tests" / "page")]
import page_figures  # noqa: E402
import page_support  # noqa: E402
from live_viewer import Viewer  # noqa: E402
from pilot_line import Line  # noqa: E402

DEAD_MAN_S = 0.3
STEER_S = 0.6
NEVER_S = 5  # a vehicle that does not hold by then never does
ROUNDS = 5


class Holds(threading.Thread):
    """When the program said that the vehicle holds (monotonic, s); it says so in the step of the flight that gives the order to the core."""

    def __init__(self, port):
        super().__init__(daemon=True)
        self.viewer, self.times = Viewer(port), []
        self.start()

    def run(self):
        while (name := self.viewer.read()) is not None:
            if name == "event" and "the vehicle holds" in str(self.viewer.last["event"]):
                self.times.append(time.monotonic())


class Flight:
    """A flight in the air, and the line to it."""

    def __init__(self, words, bytes_per_s=0, stdout=subprocess.DEVNULL):
        self.process = subprocess.Popen([str(word) for word in words], stdin=subprocess.PIPE, stdout=stdout, stderr=subprocess.PIPE, text=True)
        link = next((found for line in self.process.stderr if (found := re.search(r"http://127\.0\.0\.1:(\d+)/", line))), None)
        if not link:
            raise RuntimeError(f"{words[0]} said no address")
        threading.Thread(target=self.process.stderr.read, daemon=True).start()
        self.port, self.bytes_per_s, self.line, self.driver = int(link[1]), bytes_per_s, None, None

    def close(self):
        self.leave()
        self.process.send_signal(signal.SIGINT)
        self.process.wait(60)

    def leave(self):
        if self.line:
            self.line.close()
        if self.driver:
            self.driver.quit()
        self.line = self.driver = None

    def enter(self):
        """A new browser that has control; the vehicle flies."""
        self.leave()
        self.line, self.driver = Line(self.port, self.bytes_per_s), page_figures.open_browser(page_support.DESK, draws=False)
        self.driver.get(self.line.url)
        page_support.press(self.driver, "Take control")
        if self.driver.execute_script("return document.querySelector('.machine .flying.now') === null"):
            page_support.take_off(self.driver)
        self.wait("document.querySelector('.machine .flying.now') !== null", 20)

    def wait(self, script, seconds=20):
        return page_support.wait_for(self.driver, script, seconds)


class SteeredFlight(Flight):
    """One that is steered by keys."""

    def __init__(self, program, work):
        super().__init__([program, "fly", "teleop", "-o", work / "flown", "--serve=0"])
        self.holds = Holds(self.port)

    def enter(self):
        super().enter()
        self.driver.execute_script("[...document.querySelectorAll('.toggle')].find(t => t.innerText.includes('keys fly')).querySelector('input').click()")

    def key(self, kind, key):
        self.driver.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": kind, "key": key, "code": f"Key{key.upper()}"})

    def hold_after(self, key, harm):
        """Steers, then harms what steers: seconds from the last input that reached the server to the order to hold."""
        self.key("keyDown", key)
        self.wait("document.querySelector('.machine .flying.now')?.textContent === 'velocity'")
        time.sleep(STEER_S)
        before = len(self.holds.times)
        harm()
        end = time.monotonic() + NEVER_S
        while len(self.holds.times) == before:
            if time.monotonic() > end:
                return float(NEVER_S)
            time.sleep(0.005)
        held = self.holds.times[before]
        return held - max(made for passed, made in self.line.inputs if passed < held)


def freeze(flight):
    flight.driver.execute_script("setTimeout(() => { const end = performance.now() + 1500; while (performance.now() < end); window.thawed = true; }, 0)")


def kill(flight):
    for process in page_figures.renderers(flight.driver):
        os.kill(process, signal.SIGKILL)


def cut(flight):
    flight.line.is_cut = True


def dead_man(program, work, rounds=ROUNDS):
    """Seconds until the vehicle held, by what was done to the page."""
    held = {"frozen": [], "killed": [], "cut": []}
    flight = SteeredFlight(program, Path(work))
    try:
        for round_number in range(rounds):
            for name, harm in (("frozen", freeze), ("killed", kill), ("cut", cut)):
                flight.enter()
                held[name].append(flight.hold_after("ws"[round_number % 2], lambda harm=harm: harm(flight)))
    finally:
        flight.close()
    return held


def deviation_ms(held):
    """Worst deviation from 0.3 s; a server that sees that the page is gone may hold at once."""
    timed = [abs(seconds - DEAD_MAN_S) for name in ("frozen", "cut") for seconds in held[name]]
    return 1000 * max(timed + [max(seconds - DEAD_MAN_S, 0) for seconds in held["killed"]])


def measure(program, work):
    """(measured rows, details), or a reason why there are none."""
    if wrong := page_support.missing():
        return None, wrong
    held = dead_man(program, work)
    return [{"name": "pilot_dead", "ours": deviation_ms(held), "peer": None}], {"held_after_s": held}


if __name__ == "__main__":
    import json
    import tempfile
    with tempfile.TemporaryDirectory() as folder:
        print(json.dumps(measure(sys.argv[1], folder), indent=1))
