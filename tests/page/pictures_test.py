"""The page as it looks, on a desk and on a phone, light and dark: pictures are compared with those in pictures/.

A cell is the mean of 8 x 8 pixels, so that the rasteriser of another browser passes, and what moved, vanished or has another colour does not.
Where the machine has other fonts than those of the pictures, only the model is compared. With HM_NEW_PICTURES=1 the pictures are written
anew: look at them before they are committed."""
import base64
import io
import os
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import page_support as page  # noqa: E402
from page_support import VIEW  # noqa: E402

try:
    from PIL import Image, ImageChops
except ImportError:
    Image = None

FOLDER = Path(__file__).resolve().parent / "pictures"
CELL = 8  # pixels
MOST_MEAN = 0.6  # grey levels, mean of all cells and channels
MOST_CELLS, LEVELS = 0.004, 32  # share of cells that differ by more than so many levels
TEXT_WIDTH = """const context = document.createElement('canvas').getContext('2d');
  context.font = '100px ' + getComputedStyle(document.body).fontFamily;
  return Math.round(context.measureText('Measure 0123456789').width)"""
WIDTH_IN_PICTURES = 1093


def difference(first, second):
    """How far two pictures of one size differ: 1 is the most that is allowed."""
    apart = ImageChops.difference(first, second).tobytes()
    cells = [max(apart[i:i + 3]) for i in range(0, len(apart), 3)]
    return max(sum(apart) / len(apart) / MOST_MEAN, sum(cell > LEVELS for cell in cells) / len(cells) / MOST_CELLS)


def pixels_apart(first, second):
    """What differs clearly, as (left, top, right, bottom)."""
    clear = ImageChops.difference(first, second).convert("L").point(lambda level: 255 * (level > LEVELS / 4))
    return tuple(CELL * edge for edge in clear.getbbox() or ())


def cells_of(png):
    return Image.open(io.BytesIO(png)).convert("RGB").reduce(CELL)


class Pictures(page.PageTest):
    def open(self, *options, **browser):
        """The whole house, with the scan's clock at rest."""
        self.start("--replay", *options, **browser)
        page.pause_replay_at(self.driver, 25, "0:25")
        self.wait(f"{VIEW}.mesh.pageCount === {self.server.state()['house']}")
        self.wait(f"[...{VIEW}.mesh.shown.values()].every(page => page.levels.filter(Boolean).length === 3)")
        self.wait("document.getElementById('progress').innerText.includes('finished')")
        # Borders are searched for after the mesh has come, and figures are written twice a second: a picture rests in between.
        self.wait("/42.6\\s+m of open borders\\s+1.20\\s+m of frontiers/.test(document.getElementById('coverage').innerText)")
        self.js("document.activeElement.blur()")
        # Nothing is drawn but by screen() and model(), as finely as it can be: how coarsely the page draws by itself depends
        # on how fast the machine is, and on what was drawn before.
        self.js(f"{VIEW}.pace.begin = () => null; {VIEW}.mesh.shown.forEach(page => {{ page.drawn = 0; }}); {VIEW}.mesh.chosen = null")

    def screen(self):
        self.js(f"{VIEW}.draw()")
        return cells_of(self.driver.get_screenshot_as_png())

    def model(self):
        """The model alone, in a canvas whose size no font decides."""
        self.js(f"Object.assign({VIEW}.canvas.style, {{position: 'fixed', width: '640px', height: '400px'}})")
        return cells_of(base64.b64decode(self.js(
            f"const view = {VIEW}; view.resize(); view.fit(); view.draw(); return view.canvas.toDataURL('image/png')").split(",")[1]))

    def at_rest(self, picture):
        """A picture, once two in a row are the same."""
        last, end = picture(), time.monotonic() + 30
        while True:
            time.sleep(0.3)
            now = picture()
            if now.size == last.size and difference(last, now) < 0.02:
                return now
            self.assertLess(time.monotonic(), end, "the picture does not come to rest")
            last = now

    def compare(self, name):
        page.keep_picture(self.driver, name)
        whole = self.js(TEXT_WIDTH) == WIDTH_IN_PICTURES
        if not whole:
            print(f"{name}: this machine has other fonts: only the model is compared", flush=True)
        for part, picture in (("", self.screen), ("_model", self.model))[0 if whole else 1:]:
            now, path = self.at_rest(picture), FOLDER / f"{name}{part}.png"
            if os.environ.get("HM_NEW_PICTURES"):
                FOLDER.mkdir(exist_ok=True)
                now.save(path, optimize=True)
            self.js(f"{VIEW}.canvas.removeAttribute('style'); {VIEW}.resize(); {VIEW}.fit()")
            expected = Image.open(path).convert("RGB")
            self.assertEqual(now.size, expected.size, name + part)
            apart = difference(now, expected)
            print(f"{name}{part}: {apart:.2f} of what is allowed", flush=True)
            self.assertLess(apart, 1, f"{name}{part}: other in the pixels {pixels_apart(now, expected)}")

    def test_on_a_desk(self):
        self.open()
        self.compare("desk")
        self.what_looks_different_differs()
        self.press("normals")
        self.compare("desk_normals")
        self.press("colour")
        self.js("document.getElementById('theme').click()")
        self.compare("desk_dark")

    def what_looks_different_differs(self):
        seen = self.at_rest(self.screen)
        turn = f"{VIEW}.rig.azimuth += %s; housemartin.stage.moved = true"
        for name, change, back in (
                ("no panel", *(f"document.getElementById('panel').style.visibility = '{value}'" for value in ("hidden", ""))),
                ("no words", *(f"document.getElementById('words').style.visibility = '{value}'" for value in ("hidden", ""))),
                ("turned by three degrees", turn % 0.05, turn % -0.05)):
            self.js(change)
            self.assertGreater(difference(seen, self.at_rest(self.screen)), 1, name)
            self.js(back)

    def test_on_a_phone(self):
        self.open("--pilot", size=page.PHONE, phone=True, dark=True)
        self.compare("phone_dark")

    def test_on_a_phone_on_its_side(self):
        self.open("--pilot", size=page.PHONE_LANDSCAPE, phone=True)
        self.compare("phone_landscape")


if __name__ == "__main__":
    page.main(lambda: page.missing() or (None if Image else "python3-pil is missing"))
