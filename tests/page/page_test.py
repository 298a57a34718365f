"""The page with a made-up house: it is opened, grows, is turned, measured, clipped, saved; the server is lost and comes back."""
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import page_support as page  # noqa: E402

from page_support import VIEW  # noqa: E402

READY = "window.housemartin && housemartin.stage && housemartin.stage.view.mesh.triangleCount > 30000"
# Draws at once and returns share of the pixels whose colour (r, g, b) satisfies the expression, which may also use `back`.
SHARE = """const view = %s, copy = document.createElement('canvas'), back = getComputedStyle(document.documentElement).getPropertyValue('--scene').trim().slice(1).match(/../g).map(h => parseInt(h, 16));
  view.draw();
  [copy.width, copy.height] = [400, 300];
  const context = copy.getContext('2d');
  context.drawImage(view.canvas, 0, 0, 400, 300);
  const {data} = context.getImageData(0, 0, 400, 300);
  let count = 0;
  for (let i = 0; i < data.length; i += 4) { const [r, g, b] = data.subarray(i, i + 3); if (%s) ++count; }
  return count / 120000;"""
SURFACE = "Math.max(Math.abs(r - back[0]), Math.abs(g - back[1]), Math.abs(b - back[2])) > 6"


class Desk(unittest.TestCase):
    """One browser for all: each test leaves the page as it found it."""

    @classmethod
    def setUpClass(cls):
        cls.server = page.Fixture("--step", "0.1", "--replay")
        cls.addClassCleanup(lambda: cls.server.close())
        cls.driver = page.open_browser()
        cls.addClassCleanup(cls.driver.quit)
        cls.driver.get(cls.server.url)
        page.wait_for(cls.driver, READY)
        page.wait_for(cls.driver, f"{VIEW}.mesh.pageCount === {cls.server.state()['house']}")

    def js(self, script, *values):
        return self.driver.execute_script(script, *values)

    def press(self, *words):
        """Presses the button with these words."""
        self.assertTrue(self.js("const button = [...document.querySelectorAll('#panel button, #cameras button')].find(b => b.textContent.trim() === arguments[0]"
                                " && b.offsetParent); button?.click(); return !!button", " ".join(words)), words)

    def click_at(self, point):
        """A click of the mouse on a point of the model (metres)."""
        x, y = self.js(f"return {VIEW}.project(arguments[0])", point)
        for kind, buttons in (("mousePressed", 1), ("mouseReleased", 0)):
            self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": kind, "x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1})

    def canvas(self):
        return self.js(f"{VIEW}.draw(); return {VIEW}.canvas.toDataURL('image/png')")

    def share(self, wanted=SURFACE):
        return self.js(SHARE % (VIEW, wanted))

    def look(self, **pose):
        """Sets the camera, then returns the old one."""
        old = self.js(f"const r = {VIEW}.rig; return [r.mode, r.target, r.distance, r.azimuth, r.elevation]")
        self.js(f"Object.assign({VIEW}.rig, arguments[0]); housemartin.stage.moved = true; {VIEW}.requestDraw(); {VIEW}.draw()", pose)
        return old

    def test_the_model_and_what_goes_with_it_are_shown(self):
        page.keep_picture(self.driver, "desk")
        self.assertGreater(self.share(), 0.25)
        self.assertGreater(self.share("r > 90 && r > b + 15"), 0.03)  # wood
        for text in ("Made-up house", "Result: ok", "m² seen", "triangles"):
            self.assertIn(text, self.js("return document.body.innerText"))
        self.assertEqual(self.js("return document.querySelectorAll('#pictures img').length"), 2)
        self.assertTrue(self.js("return [...document.querySelectorAll('#pictures img')].every(i => i.naturalWidth === 160)"))
        self.assertGreater(self.js(f"return {VIEW}.paths.points(0).length"), 30)
        self.assertEqual(self.js("return housemartin.counts.refused"), 0)

    def test_open_borders_are_those_of_doors_and_windows(self):
        # Two doors of two sides each, 1 x 2 m without their sills but that of the floor; three windows; a hole in the floor.
        length = page.wait_for(self.driver, f"{VIEW}.openEdges.lengthM()")
        self.assertGreater(length, 30)
        self.assertLess(length, 60)

    def test_a_frontier_is_where_nobody_has_looked_through_the_window(self):
        self.assertAlmostEqual(page.wait_for(self.driver, f"{VIEW}.frontiers.lengthM()"), 1.2, places=3)
        self.assertTrue(page.wait_for(self.driver, "/1.20\\s+m of frontiers/.test(document.getElementById('coverage').innerText)"))
        self.assertTrue(self.js(f"return {VIEW}.frontiers.lines.visible"))
        self.assertIn("not seen beyond", self.js("return document.querySelector('.legend.marks').textContent"))
        toggle = "[...document.querySelectorAll('.toggles label')].find(label => label.textContent.trim() === 'frontiers')"
        self.js(f"{toggle}.click()")
        self.assertFalse(self.js(f"return {VIEW}.frontiers.lines.visible"))
        self.js(f"{toggle}.click()")

    def test_turning_changes_the_picture_and_the_whole_comes_back(self):
        before = self.canvas()
        old = self.js(f"return {VIEW}.rig.azimuth")
        for kind, x, buttons in (("mousePressed", 500, 1), ("mouseMoved", 560, 1), ("mouseMoved", 640, 1), ("mouseReleased", 640, 0)):
            self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": kind, "x": x, "y": 400, "button": "left", "buttons": buttons, "clickCount": 1})
        self.assertNotAlmostEqual(self.js(f"return {VIEW}.rig.azimuth"), old, delta=0.3)
        self.assertNotEqual(self.canvas(), before)
        self.js(f"{VIEW}.rig.azimuth = {old}")
        self.press("Whole")

    def test_every_colour_mode_gives_another_picture(self):
        seen = {}
        for mode in ("normals", "height", "age", "error", "colour"):
            self.js("[...document.querySelectorAll('#tabs button')].find(b => b.textContent === 'View').click()") if self.js(
                "return document.querySelector('#page-view').hidden") else None
            self.press(mode)
            picture = self.canvas()
            self.assertNotIn(picture, seen.values(), mode)
            seen[mode] = picture
            page.keep_picture(self.driver, f"mode_{mode}")
            if mode == "normals":  # blue is what faces upwards
                self.assertGreater(self.share("b > 200 && b > r + 60 && b > g + 60"), 0.05)

    def test_clipping_takes_away_what_is_above(self):
        old = self.look(mode="orbit", target=[3.7, 2.8, 1.3], distance=12, azimuth=0.6, elevation=0.5)
        before = self.share()
        slider = "document.getElementById('clip')"
        self.js(f"{slider}.value = 20; {slider}.dispatchEvent(new Event('input'))")
        page.keep_picture(self.driver, "clipped")
        self.assertLess(self.share(), 0.8 * before)
        self.assertIn("52.0", self.js("return document.querySelector('output[for=clip]').textContent"))
        self.js(f"{slider}.value = 100; {slider}.dispatchEvent(new Event('input'))")
        self.look(**dict(zip(("mode", "target", "distance", "azimuth", "elevation"), old)))

    def test_what_is_far_is_drawn_from_fewer_triangles_without_holes(self):
        # Between them every page has come in all its levels.
        page.wait_for(self.driver, f"[...{VIEW}.mesh.shown.values()].every(page => page.levels.filter(Boolean).length === 3)")
        drawn = f"(() => {{ {VIEW}.draw(); return {VIEW}.mesh.drawnTriangles; }})()"
        whole = self.js(f"return {VIEW}.mesh.triangleCount")
        view = {"mode": "orbit", "target": [3.7, 2.8, 1.3], "azimuth": 0.6, "elevation": 0.5}
        old = self.look(**view, distance=14)
        self.assertEqual(self.js(f"return {drawn}"), whole)
        last = whole
        for distance, most in ((125, 0.8), (300, 0.5)):
            self.look(**view, distance=distance)
            coarse, share = self.js(f"return {drawn}"), self.share()
            self.assertLess(coarse, most * whole)
            self.assertLess(coarse, last)
            last = coarse
            self.js(f"{VIEW}.mesh.finestOnly = true")
            self.assertEqual(self.js(f"return {drawn}"), whole)
            self.assertAlmostEqual(self.share(), share, delta=0.01 * share + 1e-4)
            self.js(f"{VIEW}.mesh.finestOnly = false")
        self.assertEqual(self.js(f"{VIEW}.picture(); return {VIEW}.mesh.drawnTriangles"), whole)
        self.assertEqual(self.js(f"return [...{VIEW}.mesh.pages()].every(page => page.level === 0)"), True)
        self.look(**dict(zip(("mode", "target", "distance", "azimuth", "elevation"), old)))

    def test_measures_agree_with_the_house(self):
        old = self.look(mode="orbit", target=[2, 1.5, 0], distance=9, azimuth=0.0, elevation=1.35)
        self.js("[...document.querySelectorAll('#tabs button')].find(b => b.textContent === 'Measure').click()")
        self.press("distance")
        for point in ([0.5, 1.0, 0.0], [3.5, 1.0, 0.0]):
            self.click_at(point)
        page.wait_for(self.driver, "housemartin.stage.measure.results.length === 1")
        self.press("area")
        for point in ([1, 0.5, 0], [3, 0.5, 0], [3, 2, 0], [1, 2, 0]):
            self.click_at(point)
        self.press("Close the area")
        self.press("room")
        self.click_at([1.5, 1.5, 0])
        page.wait_for(self.driver, "housemartin.stage.measure.results.length === 3")
        page.keep_picture(self.driver, "measured")
        results = self.js("return housemartin.stage.measure.results.map(r => r.values)")
        self.assertAlmostEqual(results[0][0]["value"], 3.0, delta=0.03)  # a pixel covers 1 cm
        self.assertAlmostEqual(results[1][0]["value"], 3.0, delta=0.05)
        for measured, true in zip(results[2], (4.0, 3.0, 2.6)):
            self.assertAlmostEqual(measured["value"], true, delta=0.002)
            self.assertLess(measured["sigma"], 0.015)
        self.assertEqual(self.js("return document.querySelectorAll('#labels span').length"), 3)
        self.js("[...document.querySelectorAll('.results button')].forEach(b => b.isConnected && b.click());"
                "while (document.querySelector('.results button')) document.querySelector('.results button').click();"
                "housemartin.stage.measure.choose(null)")
        self.look(**dict(zip(("mode", "target", "distance", "azimuth", "elevation"), old)))

    def test_a_distance_and_an_area_are_measured_by_keys_alone(self):
        old = self.look(mode="orbit", target=[2, 1.5, 0], distance=9, azimuth=0.0, elevation=1.35)
        mark = "document.getElementById('crosshair')"

        def choose(point):
            # As the arrows and W A S D would, to a place that the test knows: the camera turns about what is in the middle.
            self.look(target=point)
            self.key("Enter")

        self.js("document.body.focus()")
        self.key("m")
        self.assertFalse(self.js(f"return {mark}.hidden"))
        self.assertEqual(self.js("return document.activeElement.id"), "model", "arrows turn the model")
        middle = self.js(f"const m = {mark}.getBoundingClientRect(), c = {VIEW}.canvas.getBoundingClientRect();"
                         "return [m.x + m.width / 2 - c.x - c.width / 2, m.y + m.height / 2 - c.y - c.height / 2]")
        self.assertLess(max(map(abs, middle)), 1)
        azimuth = self.js(f"return {VIEW}.rig.azimuth")
        self.driver.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": "keyDown", "key": "ArrowLeft", "code": "ArrowLeft"})
        page.wait_for(self.driver, f"Math.abs({VIEW}.rig.azimuth - {azimuth}) > 0.05")
        self.driver.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": "keyUp", "key": "ArrowLeft", "code": "ArrowLeft"})
        for point in ([0.5, 1.0, 0.0], [3.5, 1.0, 0.0]):
            choose(point)
        page.keep_picture(self.driver, "crosshair")
        self.assertEqual(len(self.js("return housemartin.stage.measure.results")), 1)
        self.assertAlmostEqual(self.js("return housemartin.stage.measure.results[0].values[0].value"), 3.0, delta=0.03)
        # Another tool by the Tab key and Enter: Enter on a button presses it, and chooses nothing.
        self.js("[...document.querySelectorAll('#tabs button')].find(b => b.textContent === 'Measure').click();"
                "[...document.querySelectorAll('#page-measure button')].find(b => b.textContent === 'area').focus()")
        self.key("Enter")
        self.assertEqual(self.js("return housemartin.stage.measure.tool"), "area")
        for point in ([1, 0.5, 0], [3, 0.5, 0], [3, 2, 0], [1, 2, 0], [1, 2, 0]):
            choose(point)
        self.assertEqual(len(self.js("return housemartin.stage.measure.results")), 2)
        self.assertAlmostEqual(self.js("return housemartin.stage.measure.results[1].values[0].value"), 3.0, delta=0.05)
        # A pointer takes its place.
        self.click_at([2, 1, 0])
        self.assertTrue(self.js(f"return {mark}.hidden"))
        self.key("Escape")
        self.assertIsNone(self.js("return housemartin.stage.measure.tool"))
        self.js("while (document.querySelector('.results button')) document.querySelector('.results button').click()")
        self.look(**dict(zip(("mode", "target", "distance", "azimuth", "elevation"), old)))
        self.key("f")

    def test_saves_what_the_server_offers_and_a_picture(self):
        if self.js("return document.querySelector('#page-measure').hidden"):
            self.js("[...document.querySelectorAll('#tabs button')].find(b => b.textContent === 'Measure').click()")
        links = self.js("return [...document.querySelectorAll('a.button')].map(a => a.getAttribute('href'))")
        self.assertEqual(links, ["api/mesh.ply", "api/mesh.glb", "api/plan.svg"])
        self.assertIn("mesh.ply", self.driver.execute_async_script(
            "const done = arguments[1]; fetch(arguments[0]).then(r => r.text()).then(done)", links[0]))
        size = self.driver.execute_async_script(f"const done = arguments[0]; {VIEW}.picture().then(b => done([b.size, b.type]))")
        self.assertEqual(size[1], "image/png")
        self.assertGreater(size[0], 20000)

    def test_plots_events_and_parameters(self):
        self.js("[...document.querySelectorAll('#tabs button')].find(b => b.textContent === 'Plots').click()")
        page.wait_for(self.driver, "[...document.querySelectorAll('.plot:not([hidden]) h3')].length >= 6 && document.querySelectorAll('.plot canvas').length >= 6")
        page.keep_picture(self.driver, "plots")
        titles = self.js("return [...document.querySelectorAll('.plot:not([hidden]) h3')].map(h => h.textContent)")
        self.assertIn("Times of the stages (ms)", titles)
        page.wait_for(self.driver, "document.querySelector('dl.values').innerText.includes('frames dropped')")
        page.wait_for(self.driver, "document.querySelector('#page-plots pre').textContent.includes('voxel_size_m')")
        page.wait_for(self.driver, "/against the rules, refused\\s*0/.test(document.getElementById('link-counts').innerText)")
        self.js("[...document.querySelectorAll('#tabs button')].find(b => b.textContent === 'Events').click()")
        page.wait_for(self.driver, "document.querySelector('.events').innerText.includes('12 frames were dropped')")

    def test_a_replay_is_paused_and_wound(self):
        page.pause_replay_at(self.driver, 30, "0:30")
        button = "document.querySelector('#replay button')"
        self.js("document.querySelector('#replay select').value = '4'; document.querySelector('#replay select').dispatchEvent(new Event('change'))")
        self.js(f"{button}.click()")
        page.wait_for(self.driver, f"{button}.textContent !== '▶'")
        self.js("document.querySelector('#replay select').value = '1'; document.querySelector('#replay select').dispatchEvent(new Event('change'))")

    def test_keys_alone_reach_everything(self):
        self.js("document.body.focus(); window.scrollTo(0, 0)")
        reached = set()
        for _ in range(40):
            self.key("Tab")
            reached.add(self.js("const e = document.activeElement; return e.id || e.textContent.trim() || e.tagName"))
            self.assertTrue(self.js("const e = document.activeElement; return e === document.body || getComputedStyle(e).outlineStyle !== 'none' ||"
                                    " e.matches('canvas')"), "the focus is not seen")
        for name in ("theme", "help", "model", "orbit", "View"):
            self.assertIn(name, reached)
        self.key("?", "Slash")
        page.wait_for(self.driver, "document.getElementById('help-dialog').open")
        page.keep_picture(self.driver, "help")
        self.key("Escape")
        page.wait_for(self.driver, "!document.getElementById('help-dialog').open")
        for key, mode in (("4", "plan"), ("2", "walk"), ("3", "follow"), ("1", "orbit")):
            self.key(key)
            self.assertEqual(self.js(f"return {VIEW}.rig.mode"), mode)
            page.keep_picture(self.driver, f"camera_{mode}")
        self.key("f")

    def key(self, key, code=""):
        text = key if len(key) == 1 else "\r" if key == "Enter" else ""
        for kind in ("keyDown", "keyUp"):
            self.driver.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": kind, "key": key, "code": code or key, "text": text if kind == "keyDown" else "",
                                                                   "windowsVirtualKeyCode": {"Tab": 9, "Escape": 27, "Enter": 13}.get(key, ord(key[0].upper()))})

    def test_z_the_server_is_lost_and_comes_back(self):
        port, pages = self.server.port, self.js(f"return {VIEW}.mesh.pageCount")
        self.server.close()
        page.wait_for(self.driver, "!document.getElementById('banner').hidden")
        self.assertIn("The server is lost", self.js("return document.getElementById('banner').innerText"))
        self.assertEqual(self.js(f"return {VIEW}.mesh.pageCount"), pages)
        page.keep_picture(self.driver, "lost")
        type(self).server = page.Fixture("--step", "0.1", "--replay", port=port)
        page.wait_for(self.driver, "document.getElementById('banner').hidden && document.getElementById('link').textContent === 'live'")
        page.wait_for(self.driver, f"{VIEW}.mesh.pageCount === {pages}")
        state = self.server.state()
        self.assertEqual((state["knownPages"], state["pages"]), (pages, 0), "known pages were sent again")
        # A server that was started anew has another session: what was shown goes.
        self.server.close()
        type(self).server = page.Fixture("--step", "0.1", "--session", "another", port=port)
        page.wait_for(self.driver, f"document.getElementById('link').textContent === 'live' && {VIEW}.mesh.pageCount === {pages}")
        self.assertEqual(self.server.state()["knownPages"], 0)

    def test_zz_nothing_went_wrong(self):
        errors = [text for text in page.console_errors(self.driver) if "ERR_CONNECTION" not in text and "WebSocket" not in text]
        self.assertEqual(errors, [])


if __name__ == "__main__":
    page.main()
