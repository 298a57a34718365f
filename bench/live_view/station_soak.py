"""An hour of a replayed scan, over and over, with a fast viewer, five slow ones and one that is killed every ten seconds."""
import contextlib
import threading
import time
from pathlib import Path

from page_rows import port_of, run, served
from live_viewer import Viewer

SECONDS = 3600
FRAMES, SPEED = 200, 2
SLOW_BYTES_PER_S, SLOW = 300_000, 5
KILL_AFTER_S = 10
SETTLE_S = 60
REST_S = 3  # without a change of the model


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


def kill_often(port, done, count):
    """Viewers that vanish without a word."""
    while not done.is_set():
        watcher = Watcher(port)
        done.wait(KILL_AFTER_S)
        watcher.stop()
        count.append(1)


def resident_mb(process):
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024


def process_on(port):
    """The process that listens on a port of this machine."""
    sockets = {line.split()[9] for line in Path("/proc/net/tcp").read_text().splitlines()[1:]
               if line.split()[1].endswith(f":{port:04X}") and line.split()[3] == "0A"}
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            with contextlib.suppress(OSError):
                if any(str(link.readlink()) in {f"socket:[{number}]" for number in sockets} for link in (folder / "fd").iterdir()):
                    return int(folder.name)
    raise RuntimeError(f"nothing listens on port {port}")


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


def measure(program, work, seconds):
    """(measured rows, details). The growth is that of the most memory at the ends of rounds, after the first quarter against in it."""
    seconds = seconds or SECONDS
    run(program, "simulate", "room", "-o", f"{work}/scan", "--quiet", "--frames", FRAMES)
    rounds, wrong, killed, memory_mb = 0, 0, [], []
    with served(program, f"{work}/scan") as url:
        port, done = port_of(url), threading.Event()
        process = process_on(port)
        watchers = [Watcher(port), *[Watcher(port, SLOW_BYTES_PER_S) for _ in range(SLOW)]]
        threading.Thread(target=kill_often, args=(port, done, killed), daemon=True).start()
        start = time.monotonic()
        while time.monotonic() - start < seconds:
            watchers[0].viewer.send({"type": "replay", "paused": False, "speed": SPEED, "seek_s": 0})
            if not until(lambda: watchers[0].state() != "finished", SETTLE_S) or not until(lambda: watchers[0].state() == "finished", 300):
                raise RuntimeError("the replay did not end")
            wrong += different(watchers, port) + sum(not watcher.alive for watcher in watchers)
            memory_mb.append((time.monotonic() - start, resident_mb(process)))
            rounds += 1
        done.set()
        for watcher in watchers:
            watcher.stop()
    early = [mb for at_s, mb in memory_mb if at_s <= seconds / 4] or [memory_mb[0][1]]
    late = [mb for at_s, mb in memory_mb if at_s > seconds / 4] or early
    values = {"station_soak": max(0.0, 100 * (max(late) / max(early) - 1)), "station_soak_different": wrong}
    return [{"name": name, "ours": value, "peer": None} for name, value in values.items()], {
        "rounds": rounds, "killed": len(killed), "first_mb": memory_mb[0][1], "early_mb": max(early), "late_mb": max(late), "last_mb": memory_mb[-1][1]}
