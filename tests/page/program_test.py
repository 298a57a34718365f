"""The page with the program itself: a model that it serves is measured, a simulated vehicle is flown by keys and stopped."""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import page_support as page  # noqa: E402
from page_support import VIEW  # noqa: E402

ROOM = (3.2, 2.4, 2.0)


def write_room(path, step=0.08):
    """An empty room seen from inside, as a PLY of squares."""
    points, faces = [], []
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        na, nb = round(ROOM[a] / step), round(ROOM[b] / step)
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


class Program(page.PageTest):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="hm_page_"))
        self.addCleanup(shutil.rmtree, self.folder)

    def open(self, *words):
        """Starts the program and opens the link that it prints; skips where it was built without the page."""
        self.process = subprocess.Popen([os.environ["HM_PROGRAM"], *words], cwd=self.folder, text=True, stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.addCleanup(self.process.communicate, timeout=20)
        self.addCleanup(self.process.terminate)
        said = []
        for line in self.process.stdout:
            said.append(line)
            if link := re.search(r"http://127\.0\.0\.1:\d+/\S*", line):
                break
        else:
            self.fail("".join(said))
        self.driver = page.open_browser()
        self.addCleanup(self.driver.quit)
        self.driver.get(link[0])
        if "page.js" not in self.driver.page_source:
            self.skipTest("the program was built without the page")
        self.wait("window.housemartin && document.getElementById('link').textContent === 'live'")

    def test_a_model_is_measured(self):
        write_room(self.folder / "room.ply")
        self.open("serve", "room.ply", "--listen", "0")
        self.wait(f"{VIEW}.mesh.triangleCount > 4000")
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
        time.sleep(1)
        self.assertLess(self.js(f"return {VIEW}.openEdges.lengthM()"), 2.1 * 4 * sum(ROOM))
        self.assertEqual(self.errors(), [])

    def test_a_vehicle_is_flown_and_stopped(self):
        self.open("fly", "teleop", "-o", "flown", "--serve=0")
        self.press("Take control")
        self.press("Engage")
        self.press("Take off")
        self.wait("document.querySelector('.machine .flying.now')?.textContent === 'position'")
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
