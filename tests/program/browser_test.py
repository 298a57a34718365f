"""Reports in Chromium at the width of a desk and of a phone: nothing overflows, nothing is wrong, the model is seen."""
import sys
import unittest

from browser import Browser, find_browser
from support import SMALL_SET, SharedFolderTest, main, simulated

SIZES = ((1200, 800), (390, 844))
MOST_BYTES = 6e6
# A page that hangs; the bar of two seconds is the benchmark row report_draw, which has the machine to itself.
MOST_SECONDS = 20

OVERFLOW = """(() => {
  const wide = [...document.querySelectorAll('main *')].filter(e => !e.closest('.scroll, pre, svg, details')
      && e.getBoundingClientRect().right > innerWidth + 1);
  return {page: document.documentElement.scrollWidth, view: innerWidth, wide: wide.map(e => e.outerHTML.slice(0, 80))};
})()"""
# The height of letters as they are seen; hidden ones have none.
SMALL_TEXT = """[...document.querySelectorAll('svg text')].map(t => [t.textContent,
    parseFloat(getComputedStyle(t).fontSize) * Math.abs(t.getScreenCTM().a || t.getScreenCTM().b)])
    .filter(([text, size]) => size > 0 && size < 11)"""
# Share of the pixels of the model's canvas that the surface covers; and where the first screen ends.
MODEL = """(() => {
  const box = document.querySelector('.model');
  if (!box || box.hidden) return {error: box ? box.dataset.error : 'none'};
  const view = box.view, gl = view.gl, {width, height} = view.canvas;
  const seen = () => {
    view.draw();
    const pixels = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    let count = 0;
    for (let i = 3; i < pixels.length; i += 4) count += pixels[i] === 255;
    return count / (width * height);
  };
  const whole = seen(), cut = view.cut, turned = view.camera.azimuth;
  view.cut = view.data.floor + 0.5;
  const low = seen();
  view.cut = cut;
  box.querySelector('canvas').dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight'}));
  return {whole, low, turned: view.camera.azimuth - turned, triangles: view.model.indices.length / 3,
          kinds: view.kinds(), top: box.getBoundingClientRect().top, drawn_ms: +box.dataset.drawnMs,
          still: [...document.querySelectorAll('.still')].filter(e => e.offsetHeight > 0).length};
})()"""
VERDICT = "(r => [r.top, r.bottom])(document.querySelector('.verdict').getBoundingClientRect())"
WITH_MODEL = ("reconstruct", "slam", "evaluate mesh")
FEW_SAMPLES = ["--set", "mesh_error.samples=50000"]


@unittest.skipUnless(find_browser(), "no Chromium: install [test] of packages.txt")
class ReportInBrowser(SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        keeper.simulate("recording", 30)
        keeper.run_hm("reconstruct", "recording", "-o", "reconstruct", *FEW_SAMPLES)
        keeper.run_hm("evaluate", "mesh", "reconstruct/mesh.ply", "recording", "--report", "mesh.html", *FEW_SAMPLES)
        cls.pages = {"reconstruct": "reconstruct/report.html", "evaluate mesh": "mesh.html"}
        verbs = keeper.run_hm("--help").stdout
        if "slam" in verbs:
            keeper.run_hm("slam", "recording", "-o", "slam", *FEW_SAMPLES)
            keeper.run_hm("odometry", "recording", "-o", "odometry")
            keeper.run_hm("evaluate", "trajectory", "odometry/trajectory.tum", "recording", "--report", "path.html")
            keeper.run_hm("evaluate", "trajectory", "odometry/trajectory.tum", "slam/trajectory.tum", "recording", "--report",
                          "paths.html")
            keeper.simulate("flight", 200, "room", "--sensor", "laser_mav")
            keeper.run_hm("laser", "flight", "-o", "laser")
            boards, _ = simulated(*SMALL_SET)
            keeper.run_hm("calibrate", "intrinsics", boards / "color", "-o", "calibrate")
            cls.pages |= {"calibrate": "calibrate/report.html",
                          "slam": "slam/report.html", "odometry": "odometry/report.html",
                          "evaluate trajectory": "path.html", "several": "paths.html", "laser": "laser/report.html"}
        cls.browser, cls.visits = Browser(), {}

    @classmethod
    def tearDownClass(cls):
        if hasattr(cls, "browser"):
            cls.browser.close()
        super().tearDownClass()

    def show(self, page, size):
        return self.browser.open(self.keeper.folder / self.pages[page], *size)

    def visit(self, page, size):
        """What is measured of a page at this size; every page is shown once, as software draws it."""
        if (page, size) not in self.visits:
            seconds = self.show(page, size)
            found = {"seconds": seconds, "overflow": self.browser.evaluate(OVERFLOW),
                     "small_text": self.browser.evaluate(SMALL_TEXT), "verdict": self.browser.evaluate(VERDICT)}
            found["model"] = self.browser.evaluate(MODEL) if page in WITH_MODEL else None
            self.visits[page, size] = {**found, "errors": list(self.browser.errors)}
        return self.visits[page, size]

    def each(self):
        for page in self.pages:
            for size in SIZES:
                with self.subTest(page=page, width=size[0]):
                    yield page, size

    def test_nothing_overflows_and_the_console_is_silent(self):
        for page, size in self.each():
            found = self.visit(page, size)["overflow"]
            self.assertEqual(self.visit(page, size)["errors"], [])
            self.assertLessEqual(found["page"], found["view"], found["wide"])
            self.assertEqual(found["wide"], [])

    def test_text_of_plots_can_be_read_on_a_phone(self):
        for page in self.pages:
            with self.subTest(page=page):
                self.assertEqual(self.visit(page, SIZES[1])["small_text"], [])

    def test_first_screen_shows_verdict_and_model(self):
        for page, size in self.each():
            box = self.visit(page, size)["verdict"]
            self.assertGreaterEqual(box[0], 0)
            self.assertLess(box[1], 0.4 * size[1])
            model = self.visit(page, size)["model"]
            if page not in WITH_MODEL:
                continue
            self.assertNotIn("error", model)
            self.assertLess(model["top"], 0.4 * size[1])
            self.assertGreater(model["triangles"], 1000)
            self.assertGreater(model["whole"], 0.02, "the surface covers something")
            self.assertLess(model["low"], 0.7 * model["whole"], "walls are cut away")
            self.assertGreater(abs(model["turned"]), 0.01)
            self.assertEqual(model["still"], 0, "figures that the model replaces")
            if page != "slam":
                self.assertIn("error", model["kinds"])

    def test_size_and_time_to_draw(self):
        for page in self.pages:
            with self.subTest(page=page):
                self.assertLess((self.keeper.folder / self.pages[page]).stat().st_size, MOST_BYTES)
                self.assertLess(self.visit(page, SIZES[0])["seconds"], MOST_SECONDS)

    def test_without_webgl_and_on_paper_the_figures_are_shown(self):
        page = self.keeper.folder / "reconstruct" / "report.html"
        without = self.keeper.folder / "without_webgl.html"
        without.write_text(page.read_text().replace(
            "<body>", "<body><script>HTMLCanvasElement.prototype.getContext = () => null;</script>", 1))
        self.browser.open(without, *SIZES[0])
        seen = "[...document.querySelectorAll('.still')].filter(e => e.offsetHeight > 0).length"
        self.assertTrue(self.browser.evaluate("document.querySelector('.model').hidden"))
        self.assertGreater(self.browser.evaluate(seen), 2)
        self.assertEqual(self.browser.errors, [])
        self.show("reconstruct", SIZES[0])
        self.assertEqual(self.browser.evaluate(seen), 0)
        self.browser.call("Emulation.setEmulatedMedia", media="print")
        self.assertGreater(self.browser.evaluate(seen), 2)
        self.assertEqual(self.browser.evaluate("document.querySelector('.model').offsetHeight"), 0)
        self.browser.call("Emulation.setEmulatedMedia", media="")

    def test_contents_lead_to_sections(self):
        self.show("reconstruct", SIZES[0])
        self.assertTrue(self.browser.evaluate(
            "[...document.querySelectorAll('nav a')].length > 3 && [...document.querySelectorAll('nav a')]"
            ".every(a => document.querySelector(a.getAttribute('href')).querySelector('h2').textContent === a.textContent)"))


if __name__ == "__main__":
    if not find_browser():
        print("skipped: no Chromium; install [test] of packages.txt")
        sys.exit(77)
    main()
