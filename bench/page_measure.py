"""Sizes of the rooms of the simulated house, measured on the page with its tool, in a browser, against the house's plan."""
import re
from pathlib import Path

import page_figures
import page_support

ROOT = Path(__file__).resolve().parent.parent
HEIGHT_M = 2.7
# src/hm/sim/world/house_plan.cpp: inner faces x0, x1, y0, y1 and the middle of the door to the hallway, m. The bedroom ends at its
# wardrobe, 0.6 m deep, which hides more than half of the wall from the door.
ROOMS = {"living": (0, 7.94, 0, 6.58, 6.4), "dining": (8.06, 12.44, 0, 6.58, 9.6), "kitchen": (12.56, 15.94, 0, 6.58, 14.2),
         "study": (16.06, 20, 0, 6.58, 17.4), "bedroom": (0, 4.94, 8.42, 14.4, 3.6), "bath": (5.06, 7.44, 8.42, 15, 6.3),
         "kids": (7.56, 11.94, 8.42, 15, 9.4), "guest": (12.06, 16.44, 8.42, 15, 14.2), "workshop": (16.56, 20, 8.42, 15, 18.1)}
INSIDE_M = 1.2  # a person stands so far behind the door
CLICK = """const [x, y, tool] = [...arguments, 'room'], {measure, view} = housemartin.stage, before = measure.results.length;
  housemartin.stage.moved = true;
  Object.assign(view.rig, {mode: 'orbit', target: [x, y, 0], distance: 5, azimuth: 0.2, elevation: 1.3});
  view.draw();
  measure.choose(tool);
  measure.click(...view.project([x, y, 0]));
  return measure.results.length > before ? measure.results.at(-1).values : [];"""


def room_errors(url):
    """Of length, width and height of each room: measured less true, m; a size that the tool does not find is off by all of it."""
    check_plan(ROOT / "src/hm/sim/world/house_plan.cpp")
    driver = page_figures.open_browser(page_support.DESK, draws=False)
    errors = {}
    try:
        driver.get(url)
        page_figures.wait_until_whole(driver)
        for name, (x0, x1, y0, y1, door_x) in ROOMS.items():
            true = (x1 - x0, y1 - y0, HEIGHT_M)
            found = driver.execute_script(CLICK, door_x, y1 - INSIDE_M if y0 == 0 else y0 + INSIDE_M)
            values = [size["value"] for size in found] if len(found) == 3 else [0, 0, 0]
            errors[name] = [value - size for value, size in zip(values, true)]
    finally:
        driver.quit()
    return errors


def worst(errors):
    return max(abs(error) for sizes in errors.values() for error in sizes)


def check_plan(source):
    """The plan above is that of the program: its rooms' numbers stand in the source."""
    plan = re.sub(r"\s+", " ", source.read_text(encoding="utf-8"))
    for name, (x0, x1, y0, _, door_x) in ROOMS.items():
        if not re.search(rf'"{name}[^"]*", {x0}, {x1}, {y0}, [\d.]+, {door_x}', plan):
            raise RuntimeError(f"{source} has another {name}")
