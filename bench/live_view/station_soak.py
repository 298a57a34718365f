"""An hour of a replayed scan, over and over, with a fast viewer, five slow ones and one that is killed every ten seconds."""
import contextlib
import json
import math
import statistics
import threading
import time
import urllib.request

from page_rows import port_of, run, served
from live_viewer import Viewer

SECONDS = 3600
FRAMES, SPEED = 200, 2
SLOW_BYTES_PER_S, SLOW = 300_000, 5
KILL_AFTER_S = 10
SETTLE_S = 60
REST_S = 3  # without a change of the model
HEAP_REST_S = 1  # without a change of the memory
CERTAIN = 4  # standard errors: less is not told from chance


class Watcher(threading.Thread):
    """A viewer that reads until it is stopped; the last one of its frames says what the server does."""

    def __init__(self, port, bytes_per_s=0):
        super().__init__(daemon=True)
        self.viewer, self.stopped, self.alive = Viewer(port, bytes_per_s), False, True
        self.start()

    def run(self):
        with contextlib.suppress(OSError):
            while not self.stopped and self.viewer.read() is not None:
                pass
        self.alive = self.stopped

    def state(self):
        return self.viewer.last.get("telemetry", {}).get("state")

    def model(self):
        return dict(self.viewer.pages)

    def stop(self):
        self.stopped = True
        self.viewer.close()


class Killer(threading.Thread):
    """Viewers that vanish without a word, one after the other."""

    def __init__(self, port):
        super().__init__(daemon=True)
        self.port, self.done, self.killed = port, threading.Event(), 0
        self.start()

    def run(self):
        while not self.done.is_set():
            watcher = Watcher(self.port)
            self.done.wait(KILL_AFTER_S)
            watcher.stop()
            self.killed += 1

    def stop(self):
        """How many it killed; the last one sooner, so that none is there when it returns."""
        self.done.set()
        self.join()
        return self.killed


def until(condition, limit_s):
    end = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


def different(watchers, port):
    """How many viewers do not come to the model that a new one gets."""
    fresh = Viewer(port)
    wanted, changed = {}, time.monotonic()

    def at_rest(viewer):
        nonlocal wanted, changed
        if viewer.pages != wanted:
            wanted, changed = dict(viewer.pages), time.monotonic()
        return wanted and time.monotonic() - changed > REST_S

    rested = fresh.watch(at_rest, SETTLE_S)
    fresh.close()
    if not rested:
        raise RuntimeError("a new viewer got no model, or one that never came to rest")
    until(lambda: all(watcher.model() == wanted for watcher in watchers), SETTLE_S)
    return sum(watcher.model() != wanted for watcher in watchers)


def status(port):
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/status", timeout=20) as answer:
        return json.load(answer)


def memory_at_rest(port, viewers):
    """What the process uses, in bytes, when only those who stay are connected and what it holds has not changed for a while."""
    if not until(lambda: status(port)["viewers"] == viewers, SETTLE_S):
        raise RuntimeError("viewers that are gone are still connected")
    memory, changed = status(port)["memory"], time.monotonic()
    if not memory["heap"]:
        raise RuntimeError("the C library does not tell what the program holds")

    def at_rest():
        nonlocal memory, changed
        now = status(port)["memory"]
        if now["heap"] != memory["heap"]:
            changed = time.monotonic()
        memory = now
        return time.monotonic() - changed > HEAP_REST_S

    if not until(at_rest, SETTLE_S):
        raise RuntimeError("the memory does not come to rest")
    return memory


def growth(samples):
    """Growth in percent over the whole time, and the least that is told from chance, of one value a round.

    The first quarter is left out: until then caches fill. Twice the difference of the medians of the second and of the last
    quarter, which are half the time apart. Its standard error is that of medians of values that scatter independently
    (1.253 / sqrt(count) of the standard deviation, which the median distance from the median estimates)."""
    count = len(samples) // 4
    if count < 2:
        return 0.0, math.inf
    quarters = samples[-3 * count:-2 * count], samples[-count:]
    middles = [statistics.median(quarter) for quarter in quarters]
    deviation = 1.483 * statistics.median(abs(value - middle) for quarter, middle in zip(quarters, middles) for value in quarter)
    error = math.sqrt(2) * 1.253 * deviation / math.sqrt(count)
    return 200 * (middles[1] / middles[0] - 1), 200 * CERTAIN * error / middles[0]


def measure(program, work, seconds):
    """(measured rows, details). What the program holds grows by 0 if by less than is told from chance; the details have both.

    The resident set has freed blocks as well, which each of the allocator's arenas keeps: it rises in steps."""
    seconds = seconds or SECONDS
    run(program, "simulate", "room", "-o", f"{work}/scan", "--quiet", "--frames", FRAMES)
    wrong, killed, memory = 0, 0, []
    with served(program, f"{work}/scan") as url:
        port = port_of(url)
        watchers = [Watcher(port), *[Watcher(port, SLOW_BYTES_PER_S) for _ in range(SLOW)]]
        start = time.monotonic()
        while time.monotonic() - start < seconds:
            killer = Killer(port)
            watchers[0].viewer.send({"type": "replay", "paused": False, "speed": SPEED, "seek_s": 0})
            if not until(lambda: watchers[0].state() != "finished", SETTLE_S) or not until(lambda: watchers[0].state() == "finished", 300):
                raise RuntimeError("the replay did not end")
            killed += killer.stop()
            wrong += different(watchers, port) + sum(not watcher.alive for watcher in watchers)
            memory.append(memory_at_rest(port, len(watchers)))
        for watcher in watchers:
            watcher.stop()
    heap, resident = (growth([one[name] for one in memory]) for name in ("heap", "process"))
    values = {"station_soak": round(heap[0], 1) if heap[0] > heap[1] else 0.0, "station_soak_resident": max(0.0, round(resident[0], 1)),
              "station_soak_different": wrong}
    mb = {name: [round(one[name] / 1e6, 3) for one in memory] for name in ("heap", "process")}
    return [{"name": name, "ours": value, "peer": None} for name, value in values.items()], {
        "rounds": len(memory), "killed": killed, "heap_growth": heap[0], "heap_least_told": heap[1],
        "resident_growth": resident[0], "resident_least_told": resident[1], "heap_mb": mb["heap"], "resident_mb": mb["process"]}
