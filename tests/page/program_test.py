"""The page with the program itself: a model that it serves is measured, a run grows, another fails and says why; a simulated
vehicle is flown by keys and by sticks, and stopped."""
import os
import pty
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import page_support as page  # noqa: E402
from page_support import VIEW  # noqa: E402

ROOM, STEP = (3.2, 2.4, 2.0), 0.08


def write_room(path):
    """An empty room seen from inside, as a PLY of squares; returns the number of triangles."""
    points, faces = [], []
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        na, nb = round(ROOM[a] / STEP), round(ROOM[b] / STEP)
        for side in (0, 1):
            first = len(points)
            for j in range(nb + 1):
                for i in range(na + 1):
                    point = [0.0, 0.0, 0.0]
                    point[axis], point[a], point[b] = side * ROOM[axis], i * ROOM[a] / na, j * ROOM[b] / nb
                    points.append(point)
            for j in range(nb):
                for i in range(na):
                    corners = [first + j * (na + 1) + i, first + j * (na + 1) + i + 1, first + (j + 1) * (na + 1) + i + 1, first + (j + 1) * (na + 1) + i]
                    faces.append(corners[::-1] if side else corners)
    lines = ["ply", "format ascii 1.0", f"element vertex {len(points)}", *(f"property float {name}" for name in "xyz"),
             f"element face {2 * len(faces)}", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(f"{value:.6f}" for value in point) for point in points]
    lines += [f"3 {a} {b} {c}\n3 {a} {c} {d}" for a, b, c, d in faces]
    path.write_text("\n".join(lines) + "\n")
    return 2 * len(faces)


class Slowed:
    """A process that may run a tenth of the time, until the end of the block: what it does lasts longer than a page takes to load,
    however fast the machine is."""

    def __init__(self, process):
        self.process = process
        self.ended = threading.Event()
        self.thread = threading.Thread(target=self.stop_and_continue, daemon=True)

    def stop_and_continue(self):
        while not self.ended.wait(0.02):
            self.process.send_signal(signal.SIGSTOP)
            self.ended.wait(0.18)
            self.process.send_signal(signal.SIGCONT)

    def __enter__(self):
        self.thread.start()

    def __exit__(self, *_):
        self.ended.set()
        self.thread.join()


class Program(page.PageTest):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="hm_page_"))
        self.addCleanup(shutil.rmtree, self.folder)

    def simulate(self, *words):
        subprocess.run([os.environ["HM_PROGRAM"], "simulate", *words, "--quiet"], cwd=self.folder, check=True, timeout=120)

    def start_program(self, *words):
        """On a terminal, where a run stays open to viewers; what it says is read all the time, as terminals do."""
        terminal, of_program = pty.openpty()
        self.process = subprocess.Popen([os.environ["HM_PROGRAM"], *words], cwd=self.folder, stdin=subprocess.PIPE, stdout=of_program,
                                        stderr=of_program)
        os.close(of_program)
        self.said = ""
        reader = threading.Thread(target=self.read_terminal, args=(terminal,), daemon=True)
        reader.start()
        for clean in (reader.join, self.end_program):
            self.addCleanup(clean)

    def end_program(self):
        self.process.terminate()
        self.process.stdin.close()
        self.process.wait(timeout=120)  # it saves what it has

    def read_terminal(self, terminal):
        try:
            while more := os.read(terminal, 4096):
                self.said += more.decode(errors="replace")
        except OSError:  # the program has ended
            pass
        os.close(terminal)

    def open(self, *words, **browser):
        """Starts the program and opens the link that it prints."""
        self.start_browser_and_program(*words, **browser)
        self.open_link()

    def start_browser_and_program(self, *words, **browser):
        """Starts a browser, then the program."""
        self.driver = page.open_browser(**browser)
        self.addCleanup(self.driver.quit)
        self.start_program(*words)

    def open_link(self):
        """Opens the link that the program prints; skips where it was built without the page."""
        end = time.monotonic() + 60
        while not (link := re.search(r"http://127\.0\.0\.1:\d+/\S*(?=\s)", self.said)):
            self.assertLess(time.monotonic(), end, self.said)
            self.assertIsNone(self.process.poll(), self.said)
            time.sleep(0.02)
        self.driver.get(link[0])
        if "page.js" not in self.driver.page_source:
            self.skipTest("the program was built without the page")
        self.wait("window.housemartin && document.getElementById('link').textContent === 'live'")

    def test_a_model_is_measured(self):
        triangles = write_room(self.folder / "room.ply")
        self.open("serve", "room.ply", "--listen", "0")
        self.wait(f"{VIEW}.mesh.triangleCount === {triangles}")
        self.assertEqual(self.js("return housemartin.counts.refused"), 0)
        measured = self.wait("""(() => {
            const measure = housemartin.stage.measure, view = housemartin.stage.view;
            measure.choose('room');
            Object.assign(view.rig, {mode: 'orbit', target: [1.6, 1.2, 0], distance: 5, azimuth: 0.2, elevation: 1.2});
            view.draw();
            measure.click(...view.project([1.5, 1.1, 0]));
            return measure.results.at(-1)?.values;
        })()""")
        page.keep_picture(self.driver, "program_room")
        for value, true in zip(sorted(m["value"] for m in measured), sorted(ROOM)):
            self.assertAlmostEqual(value, true, delta=0.005)
        # Closed: an edge that two pages share is open in neither.
        self.wait(f"{VIEW}.openEdges.lengthM() < {2.1 * 4 * sum(ROOM)}")
        self.assertEqual(self.errors(), [])

    def test_a_run_grows(self):
        """What is shown in the end is the whole map of the run."""
        self.simulate("room", "--sensor", "kinect", "--frames", "120", "-o", "recording")
        self.start_browser_and_program("reconstruct", "recording", "-o", "result", "--voxel", "0.015", "--threads", "1", "--serve=0")
        count = f"{VIEW}.mesh.triangleCount"
        with Slowed(self.process):
            self.open_link()
            first = self.wait(f"{count} > 0 && {count}")
            self.assertEqual(self.js("return document.getElementById('source').textContent"), "recording")
            self.wait("/reconstructing \\d+ of 120/.test(document.getElementById('progress').innerText)")
            page.keep_picture(self.driver, "program_growing")
        self.wait(f"{count} > {first} && {VIEW}.paths.points(0).length > 0")
        page.wait_for(self.driver, "document.getElementById('progress').innerText === 'finished'", 240)
        self.wait("document.getElementById('words').innerText.includes('Result: ok')")
        self.assertGreater(self.js(f"return {count}"), first)
        self.tab("Plots")
        self.wait("document.querySelector('#page-plots pre').textContent.includes('voxel_size_m = 0.015')")
        self.wait("document.getElementById('link-counts').innerText.includes('refused')")
        self.assertEqual(self.js("return housemartin.counts.refused"), 0)
        self.tab("Measure")
        self.wait("[...document.querySelectorAll('a.button')].some(a => a.download === 'report.html' && a.offsetParent)")
        self.assertEqual(self.errors(), [])

    def test_an_unplugged_scan_says_why(self):
        self.simulate("room", "--sensor", "kinect", "--frames", "60", "-o", "recording")
        for size, phone in ((page.DESK, False), (page.PHONE, True)):
            self.open("scan", "--camera", "replay:recording", "-o", f"scan_{phone}", "--voxel", "0.04", "--unplug-after", "1.2", "--serve=0",
                      size=size, phone=phone)
            self.wait("document.querySelector('.word strong')?.textContent === 'Failed'")
            reason = "document.querySelector('.word .number')"
            self.wait(f"{reason}.innerText.includes('unplugged after 1.2 s')")
            page.keep_picture(self.driver, f"program_unplugged_{'phone' if phone else 'desk'}")
            box = self.js(f"const b = {reason}.getBoundingClientRect(); return [b.width, b.height, b.left, innerWidth - b.right]")
            self.assertTrue(min(box[:2]) > 0 and min(box[2:]) >= 0, box)
            self.tab("Events")
            self.wait("document.querySelector('.events [data-level=error]').innerText.includes('failed: ')")
            self.wait("document.querySelector('.word .number').offsetParent")  # with the panel open too
            self.driver.quit()
            self.end_program()

    def take_off(self):
        self.press("Take control")
        page.take_off(self.driver)
        self.wait("document.querySelector('.machine .flying.now')?.textContent === 'position'")

    def test_a_vehicle_is_flown_by_sticks(self):
        self.open("fly", "teleop", "-o", "flown", "--serve=0", size=page.PHONE, phone=True)
        self.wait("[...document.querySelectorAll('#tabs button')].some(b => b.textContent === 'Fly')")
        self.tab("Fly")
        self.take_off()
        self.tab("Fly")  # closes the panel
        self.wait("!document.getElementById('sticks').hidden")
        place, flying = f"{VIEW}.lastPose.position", "document.querySelector('.machine .flying.now')?.textContent"
        start = self.js(f"return {place}")
        x, y = self.middle_of(".stick:last-child")
        self.touch("touchStart", (x, y))
        self.touch("touchMove", (x, y - 50))
        self.wait(f"{flying} === 'velocity'")
        self.wait(f"Math.hypot({place}[0] - {start[0]}, {place}[1] - {start[1]}) > 0.3")
        page.keep_picture(self.driver, "program_sticks")
        self.touch("touchEnd")
        self.wait(f"{flying} === 'hold'")
        x, y = self.middle_of(".stop")
        self.touch("touchStart", (x, y))
        self.touch("touchEnd")
        self.wait("document.querySelector('.machine .error.now') !== null")
        self.assertEqual(self.errors(), [])

    def test_a_vehicle_is_flown_and_stopped(self):
        self.open("fly", "teleop", "-o", "flown", "--serve=0")
        self.take_off()
        self.wait("[...document.querySelectorAll('dt')].find(term => term.textContent === 'who flies')?.nextSibling.textContent === 'page'")
        place = f"{VIEW}.lastPose.position"
        start = self.js(f"return {place}")
        self.js("[...document.querySelectorAll('.toggle')].find(t => t.innerText.includes('keys fly')).querySelector('input').click()")
        self.driver.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": "keyDown", "key": "w", "code": "KeyW"})
        self.wait("document.querySelector('.machine .flying.now')?.textContent === 'velocity'")
        self.wait(f"Math.hypot({place}[0] - {start[0]}, {place}[1] - {start[1]}) > 0.3")
        self.driver.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": "keyUp", "key": "w", "code": "KeyW"})
        self.wait("document.querySelector('.machine .flying.now')?.textContent === 'hold'")
        page.keep_picture(self.driver, "program_fly")
        self.driver.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": "keyDown", "key": " ", "code": "Space"})
        self.wait("document.querySelector('.machine .error.now') !== null")
        self.assertEqual(self.errors(), [])


def missing():
    return page.missing() or (None if os.environ.get("HM_PROGRAM") else "HM_PROGRAM names no program")


if __name__ == "__main__":
    page.main(missing)
