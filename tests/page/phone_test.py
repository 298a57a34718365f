"""The page on a phone, while a scan grows, on a thin line, and without WebGL."""
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import page_support as page  # noqa: E402
from page_support import VIEW  # noqa: E402

OVERFLOW = """const wide = [...document.querySelectorAll('body *')].filter(e => e.offsetParent && !e.closest('svg, dialog, .u-wrap, #labels, pre, #tabs')
    && (e.getBoundingClientRect().right > innerWidth + 1 || e.getBoundingClientRect().left < -1)).map(e => e.id || e.className || e.tagName);
  return [document.documentElement.scrollWidth > innerWidth, document.documentElement.scrollHeight > innerHeight, ...wide.filter(w => w !== 'skip')];"""
# What can be pressed, and is smaller than a finger.
SMALL = """return [...document.querySelectorAll('button, select, a.button')].filter(e => e.offsetParent && !e.disabled)
    .map(e => [e.textContent.trim() || e.getAttribute('aria-label'), e.getBoundingClientRect()])
    .filter(([name, box]) => Math.min(box.width, box.height) < 30).map(([name]) => name)"""

# Pairs of what lies over the model or around it and covers the other; what is in a panel may be scrolled away.
COVERED = """const shown = [...document.querySelectorAll('button, select, input, a.button, .word, #hint, #coverage > div, .stick')]
    .filter(e => e.checkVisibility() && !e.closest('dialog, #pages')).map(e => [e, e.getBoundingClientRect()]);
  const name = e => e.getAttribute('aria-label') || e.textContent.trim();
  return shown.flatMap(([one, a], i) => shown.slice(0, i).filter(([other, b]) =>
    Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1)
    .map(([other]) => `${name(one)} on ${name(other)}`));"""
# The same with as many words as there may be.
COVERED_BY_ALL_WORDS = """const words = document.getElementById('words'), shown = [...words.childNodes];
  const word = (text, number) => `<div class="word" data-level="warning"><span class="mark">!</span><span><strong>${text}</strong><span class="number">${number}</span></span></div>`;
  words.innerHTML = word('Too near', '0.42 m, 0.6 m or more is good') + word('Too fast', '1.2 m/s, 0.5 m/s or less is good') + word('Result: ok', 'all frames tracked');
  const covered = (() => { """ + COVERED + """ })();
  words.replaceChildren(...shown);
  return covered;"""
UPRIGHT, ON_ITS_SIDE = ((360, 640), page.PHONE), ((568, 320), (640, 360), page.PHONE_LANDSCAPE)


class Phone(page.PageTest):
    def test_fits_and_is_moved_by_fingers(self):
        self.start("--pilot", size=page.PHONE, phone=True, dark=True)
        self.wait(f"{VIEW}.mesh.pageCount === {self.server.state()['house']}")
        page.keep_picture(self.driver, "phone_dark")
        for tab in ("View", "Measure", "Plots", "Events", "Fly"):
            self.tab(tab)
            time.sleep(0.3)
            page.keep_picture(self.driver, f"phone_{tab.lower()}")
            self.assertEqual(self.js(OVERFLOW), [False, False], tab)
            self.assertEqual(self.js(SMALL), [], tab)
        self.tab("Fly")
        rig = f"(r => [r.azimuth, r.distance])({VIEW}.rig)"
        azimuth = self.js(f"return {rig}")[0]
        self.touch("touchStart", (120, 500))
        for x in (150, 190, 230):
            self.touch("touchMove", (x, 500))
        self.touch("touchEnd")
        self.wait(f"Math.abs({rig}[0] - {azimuth}) > 0.3")
        distance = self.js(f"return {rig}")[1]
        self.touch("touchStart", (150, 500), (240, 500))
        for spread in (20, 40, 60):
            self.touch("touchMove", (150 - spread, 500), (240 + spread, 500))
        self.touch("touchEnd")
        self.wait(f"{rig}[1] < 0.7 * {distance}")
        self.assertEqual(self.errors(), [])

    def test_nothing_covers_anything_beside_the_replay(self):
        for size in (*UPRIGHT, *ON_ITS_SIDE, (1024, 600), page.DESK):
            phone = min(size) < 480
            self.start("--pilot", "--replay", size=size, phone=phone)
            self.wait("!document.getElementById('replay').hidden")
            self.wait("document.querySelectorAll('#coverage > div').length >= 6 && document.querySelectorAll('.word').length >= 2")
            for tab in ("", "Fly", "View"):
                if tab:
                    self.tab(tab)
                    time.sleep(0.3)
                page.keep_picture(self.driver, f"replay_{size[0]}_{size[1]}_{tab or 'first'}")
                self.assertEqual(self.js(COVERED), [], (size, tab))
                self.assertEqual(self.js(COVERED_BY_ALL_WORDS), [], (size, tab))
                self.assertEqual(self.js(OVERFLOW), [False, False], (size, tab))
            self.driver.quit()
            self.server.close()

    def test_nothing_covers_anything_beside_the_sticks(self):
        for size in ON_ITS_SIDE:
            self.start("--pilot", size=size, phone=True)
            self.tab("Fly")
            self.press("Take control")
            self.wait("!document.getElementById('sticks').hidden")
            for open_panel in (True, False):
                if not open_panel:
                    self.tab("Fly")
                    self.wait("document.getElementById('panel').dataset.open === 'false'")
                page.keep_picture(self.driver, f"sticks_{size[0]}_{open_panel}")
                self.assertEqual(self.js(COVERED), [], (size, open_panel))
            self.driver.quit()
            self.server.close()

    def test_lies_on_its_side(self):
        self.start("--pilot", size=page.PHONE_LANDSCAPE, phone=True)
        self.wait(f"{VIEW}.mesh.pageCount > 10")
        page.keep_picture(self.driver, "phone_landscape")
        self.assertEqual(self.js(OVERFLOW), [False, False])
        self.tab("Fly")
        page.keep_picture(self.driver, "phone_landscape_fly")
        self.assertEqual(self.js(OVERFLOW), [False, False])
        self.assertGreater(self.js("return document.getElementById('stage').clientWidth"), 400)


class Growing(page.PageTest):
    def test_a_scan_grows_and_its_whole_stays_in_view(self):
        self.start("--grow", "8")
        self.wait(f"{VIEW}.mesh.pageCount > 0")
        first = self.js(f"return {VIEW}.mesh.pageCount")
        page.keep_picture(self.driver, "growing")
        self.wait(f"{VIEW}.mesh.pageCount > {first} + 5")
        self.wait("document.getElementById('progress').innerText.includes('finished')")
        self.wait(f"{VIEW}.mesh.pageCount === {self.server.state()['house']}")
        # The camera follows within a moment, or several where pictures are drawn slowly.
        self.wait(f"""(() => {{
            const box = {VIEW}.box(), stage = document.getElementById('stage').getBoundingClientRect();
            return [0, 1, 2, 3, 4, 5, 6, 7].every(corner => {{
              const [x, y] = {VIEW}.project([0, 1, 2].map(k => corner >> k & 1 ? box.high[k] : box.low[k]));
              return x >= stage.left && x <= stage.right && y >= stage.top && y <= stage.bottom;
            }});
          }})()""")
        self.assertEqual(self.errors(), [])

    def test_a_thin_line_brings_all_of_it(self):
        self.server = page.Fixture()
        self.addCleanup(self.server.close)
        self.driver = page.open_browser()
        self.addCleanup(self.driver.quit)
        self.driver.execute_cdp_cmd("Network.enable", {})
        self.driver.execute_cdp_cmd("Network.emulateNetworkConditions", {
            "offline": False, "latency": 80, "downloadThroughput": 400_000, "uploadThroughput": 50_000})
        self.driver.get(self.server.url)
        self.wait(f"window.housemartin && {VIEW}.mesh.pageCount === {self.server.state()['house']}")
        self.wait(f"[...{VIEW}.mesh.pages()].every(p => p.level === 0)")
        self.assertEqual(self.errors(), [])


class WithoutWebGl(page.PageTest):
    def test_says_so_and_shows_plan_and_plots(self):
        self.start(webgl=False)
        self.assertTrue(self.js("return housemartin.stage === null"))
        self.assertIn("No WebGL 2 here", self.js("return document.body.innerText"))
        self.wait("housemartin.plan.triangleCount > 30000")
        self.wait("document.querySelectorAll('.plot canvas').length >= 3")
        time.sleep(0.3)
        self.assertEqual(self.js("return housemartin.plan.triangleCount"), self.server.state()["triangles"])
        self.wait("Math.abs(housemartin.plan.lengthM() - 1.2) < 1e-3")  # the frontier of the occupancy
        page.keep_picture(self.driver, "without_webgl")
        seen = self.js("""const c = document.getElementById('plan'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
            let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n / (c.width * c.height)""")
        self.assertGreater(seen, 0.1)
        self.assertEqual(self.errors(), [])


if __name__ == "__main__":
    page.main()
