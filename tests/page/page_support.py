"""The page in Chromium, driven by selenium, served by web/testing/fixture.mjs. Skips (77) where something is missing."""
import json
import os
import shutil
import subprocess
import sys
import time
import unittest
import urllib.request
from pathlib import Path

try:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
except ImportError:
    webdriver = None

SOURCE = Path(__file__).resolve().parents[2]
SKIPPED = 77
VIEW = "housemartin.stage.view"
FLAGS = ["--headless=new", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--disable-quic", "--no-first-run", "--disable-extensions", "--mute-audio",
         "--hide-scrollbars", "--disable-dev-shm-usage",
         # Pages of its own, which it would load beside the one that is opened.
         "--disable-features=WebUIOmniboxPopup,WebUIOmniboxAimPopup,WebUIOmniboxFullPopup", "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"]
DESK, PHONE, PHONE_LANDSCAPE = (1280, 800), (390, 844), (844, 390)


def missing_for_node():
    """What is missing to run the page's own code, or None."""
    if not shutil.which("node"):
        return "node is missing"
    if not all((SOURCE / "web/node_modules" / name).is_dir() for name in ("esbuild", "ws", "typescript")):
        return "the page's packages are missing (npm ci in web/)"
    return None


def missing():
    """What is missing to run the page in a browser, or None."""
    if webdriver is None:
        return "python3-selenium is missing"
    for program in ("chromium", "chromedriver"):
        if not shutil.which(program):
            return f"{program} is missing"
    return missing_for_node()


class Fixture:
    """A made-up server of the page on a port of its own."""

    def __init__(self, *options, port=0):
        self.process = subprocess.Popen(["node", str(SOURCE / "web/testing/fixture.mjs"), "--port", str(port), *options],
                                        stdout=subprocess.PIPE, text=True)
        self.url = self.process.stdout.readline().strip()
        if not self.url:
            raise RuntimeError("the made-up server did not start")
        self.port = int(self.url.rsplit(":", 1)[1].strip("/"))

    def state(self):
        with urllib.request.urlopen(self.url + "test/state", timeout=10) as answer:
            return json.load(answer)

    def close(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()


def open_browser(size=DESK, phone=False, dark=False, webgl=True):
    """A browser without a window, at the size of a desk or a phone."""
    options = webdriver.ChromeOptions()
    options.binary_location = os.environ.get("HM_BROWSER") or shutil.which("chromium")
    flags = FLAGS if webgl else [flag for flag in FLAGS if "angle" not in flag and "swiftshader" not in flag] + [
        "--disable-gpu", "--disable-webgl", "--disable-3d-apis"]
    for flag in [*flags, f"--window-size={size[0]},{size[1]}"]:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    if phone:
        options.add_experimental_option("mobileEmulation", {
            "deviceMetrics": {"width": size[0], "height": size[1], "pixelRatio": float(os.environ.get("HM_PIXEL_RATIO", "1")), "touch": True}})
    driver = webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)
    if not phone:
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
            "width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False})
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {
        "features": [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]})
    return driver


def wait_for(driver, script, seconds=60, what=None):
    """The first true value of an expression of the page, which may fail while what it looks at is not there. The bound is for busy
    machines."""
    end = time.monotonic() + seconds
    while True:
        value, error = driver.execute_script(f"try {{ return [{script}, '']; }} catch (error) {{ return [null, ': ' + error]; }}")
        if value:
            return value
        if time.monotonic() > end:
            raise AssertionError(f"{what or script}: not within {seconds} s{error}")
        time.sleep(0.05)


def pause_replay_at(driver, time_s, clock):
    """Stops the replay of the made-up scan, which lasts a minute, at a moment that the page then shows as `clock`."""
    wait_for(driver, "!document.getElementById('replay').hidden")
    driver.execute_script("document.querySelector('#replay button').click()")
    wait_for(driver, "document.querySelector('#replay button').textContent === '▶'")
    driver.execute_script("const s = document.querySelector('#replay input'); s.value = arguments[0];"
                          "s.dispatchEvent(new Event('input')); s.dispatchEvent(new Event('change'))", 1000 * time_s / 60)
    wait_for(driver, f"document.querySelector('#replay .time').textContent.startsWith('{clock}')")


def press(driver, words):
    """Presses a button of the panel once it can be pressed."""
    find = f"[...document.querySelectorAll('#panel button')].find(b => b.textContent.trim() === '{words}' && !b.disabled)"
    wait_for(driver, find)
    driver.execute_script(f"{find}.click()")


def take_off(driver):
    """Engages and takes off, by who has control. Taking off is refused until a vehicle has stood still for a second: then it is
    pressed again, as a person would."""
    press(driver, "Engage")
    told = "document.querySelector('#panel .reason').textContent"
    for _ in range(10):
        driver.execute_script(f"{told} = ''")
        press(driver, "Take off")
        if "has not stood still for a second" not in wait_for(driver, f"{told}.includes('take off') && {told}"):
            return
        time.sleep(0.5)


def console_errors(driver):
    return [entry["message"] for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]


def keep_picture(driver, name):
    """Keeps a screenshot in $HM_PICTURES, to be looked at."""
    if folder := os.environ.get("HM_PICTURES"):
        Path(folder).mkdir(parents=True, exist_ok=True)
        driver.save_screenshot(str(Path(folder) / f"{name}.png"))


class PageTest(unittest.TestCase):
    """Each test with a server and a browser of its own."""

    def start(self, *options, **browser):
        self.server = Fixture("--step", "0.1", *options)
        self.addCleanup(self.server.close)
        self.driver = open_browser(**browser)
        self.addCleanup(self.driver.quit)
        self.driver.get(self.server.url)
        wait_for(self.driver, "window.housemartin && document.getElementById('link').textContent === 'live'")

    def js(self, script, *values):
        return self.driver.execute_script(script, *values)

    def wait(self, script):
        return wait_for(self.driver, script)

    def tab(self, name):
        self.js("[...document.querySelectorAll('#tabs button')].find(b => b.textContent === arguments[0]).click()", name)

    def press(self, words):
        press(self.driver, words)

    def touch(self, kind, *points):
        self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [
            {"x": x, "y": y, "id": number} for number, (x, y) in enumerate(points)]})

    def middle_of(self, selector):
        return self.js("const b = document.querySelector(arguments[0]).getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]", selector)

    def errors(self):
        return [text for text in console_errors(self.driver) if "WebSocket" not in text]


def main(missing=missing):
    """Runs the tests of the file, or says what is missing for them."""
    if reason := missing():
        print(f"skipped: {reason}")
        sys.exit(SKIPPED)
    unittest.main(verbosity=2)
