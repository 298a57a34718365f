"""Flying a made-up vehicle from the page: sticks, keys, a point in the model, the emergency stop."""
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import page_support as page  # noqa: E402
from page_support import VIEW  # noqa: E402


class Flying(page.PageTest):
    def vehicle(self):
        return self.server.state()["vehicle"]

    def wait_for_vehicle(self, name, wanted, seconds=5):
        """Until its state or phase is this one."""
        end = time.monotonic() + seconds
        while (found := self.vehicle()[name]) != wanted and time.monotonic() < end:
            time.sleep(0.05)
        self.assertEqual(found, wanted)

    def take_off(self):
        self.press("Take control")
        self.press("Engage")
        self.press("Take off")
        self.wait_for_vehicle("phase", "hold", 15)

    def test_by_sticks_then_to_a_point_then_stop(self):
        self.start("--pilot", size=page.PHONE, phone=True)
        self.tab("Fly")
        self.take_off()
        self.tab("Fly")  # closes the panel
        self.wait("!document.getElementById('sticks').hidden")
        page.keep_picture(self.driver, "phone_sticks")
        x, y = self.middle_of(".stick:last-child")
        self.touch("touchStart", (x, y))
        self.touch("touchMove", (x, y - 50))
        time.sleep(0.6)
        moving = self.vehicle()
        self.assertEqual(moving["phase"], "velocity")
        self.assertGreater(moving["velocity_m_s"][0], 0.2)  # held still it goes on
        self.touch("touchEnd")
        time.sleep(0.8)
        self.assertEqual(self.vehicle()["phase"], "hold")
        x, y = self.middle_of(".stop")
        self.touch("touchStart", (x, y))
        self.touch("touchEnd")
        self.wait_for_vehicle("state", "error", 3)

    def test_by_a_gamepad_that_is_let_go_and_unplugged(self):
        self.start("--pilot")
        self.take_off()
        # The browser has no gamepad to press: what the page asks for is one of ours.
        self.js("window.pad = {connected: true, mapping: 'standard', axes: [0, 0, 0, 0]}; navigator.getGamepads = () => [null, window.pad]")
        self.js("pad.axes = [0, 0, 0, -0.9]")
        self.wait_for_vehicle("phase", "velocity")
        time.sleep(0.5)
        self.assertGreater(self.vehicle()["velocity_m_s"][0], 0.2)
        self.js("pad.axes = [0.02, -0.03, 0.05, 0.05]")  # sticks do not rest at zero
        self.wait_for_vehicle("phase", "hold")
        self.js("pad.axes = [0, -0.9, 0, 0]")
        self.wait_for_vehicle("phase", "velocity")
        self.js("pad.connected = false")
        self.wait_for_vehicle("phase", "hold")
        self.assertEqual(self.errors(), [])

    def test_by_keys_and_a_point_in_the_model_and_a_page_that_hangs(self):
        self.start("--pilot")
        self.wait(f"{VIEW}.mesh.pageCount === {self.server.state()['house']}")
        self.take_off()
        page.keep_picture(self.driver, "desk_fly")
        self.js("[...document.querySelectorAll('.toggle')].find(t => t.innerText.includes('keys fly')).querySelector('input').click()")
        self.key("keyDown", "KeyW", "w")
        time.sleep(0.4)
        self.assertEqual(self.vehicle()["phase"], "velocity")
        # The page hangs with the key held: the Worker sends nothing more, the vehicle holds.
        self.js("setTimeout(() => { const end = performance.now() + 1500; while (performance.now() < end); window.hung = true; }, 0)")
        end = time.monotonic() + 5
        while self.server.state()["heldAfterMs"] is None and time.monotonic() < end:
            time.sleep(0.05)
        self.assertLess(self.server.state()["heldAfterMs"], 400)
        self.wait("window.hung")
        self.key("keyUp", "KeyW", "w")
        self.wait("document.querySelector('.machine .flying').textContent === 'hold'")
        self.press("Go to a point")
        self.js(f"Object.assign({VIEW}.rig, {{mode: 'orbit', target: [2, 1.5, 0], distance: 9, azimuth: 0, elevation: 1.35}}); housemartin.stage.moved = true; {VIEW}.draw()")
        for point, words in (([6, 1.2, 0], "No way there"), ([3, 1, 0], "The way is free")):
            if "No way" not in words:
                self.press("Go to a point")
            self.click(point)
            self.wait(f"document.querySelector('.reason').textContent.startsWith('{words}')")
        page.keep_picture(self.driver, "desk_preview")
        # By keys alone: the crosshair in the middle of the view, and Enter.
        self.js("[...document.querySelectorAll('#panel button')].find(b => b.textContent === 'Go to a point').focus()")
        for kind in ("keyDown", "keyUp"):
            self.key(kind, "Enter", "Enter", "\r")
        self.assertFalse(self.js("return document.getElementById('crosshair').hidden"))
        self.js(f"{VIEW}.rig.target = [3, 1.2, 0]; {VIEW}.draw()")
        for kind in ("keyDown", "keyUp"):
            self.key(kind, "Enter", "Enter", "\r")
        self.wait("document.getElementById('crosshair').hidden")
        self.wait("document.querySelector('.reason').textContent.startsWith('The way is free')")
        self.press("Fly there")
        self.wait_for_vehicle("phase", "position")
        self.key("keyDown", "Space", " ")
        self.wait("document.querySelector('.machine .error.now') !== null")
        page.keep_picture(self.driver, "desk_stopped")
        self.assertEqual(self.vehicle()["state"], "error")
        self.assertEqual(self.errors(), [])

    def click(self, point):
        x, y = self.js(f"return {VIEW}.project(arguments[0])", point)
        for kind, buttons in (("mousePressed", 1), ("mouseReleased", 0)):
            self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": kind, "x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1})

    def key(self, kind, code, key, text=""):
        self.driver.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": kind, "key": key, "code": code, "text": text if kind == "keyDown" else "",
                                                               **({"windowsVirtualKeyCode": 13} if key == "Enter" else {})})


if __name__ == "__main__":
    page.main()
