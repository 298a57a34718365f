"""Sizes of the rooms of the simulated house, measured on the page with its tool, in a browser, against the house's plan."""
import re
from pathlib import Path

import page_figures
import page_support

PLAN = Path(__file__).resolve().parent.parent.parent / "src/hm/sim/world/house_plan.cpp"
HEIGHT_M = 2.7
WARDROBE_M = 0.6  # it hides more than half of the bedroom's far wall from the door: there the room ends at it
INSIDE_M = 1.2  # a person stands so far behind the door
CLICK = """const [x, y, tool] = [...arguments, 'room'], {measure, view} = housemartin.stage, before = measure.results.length;
  housemartin.stage.moved = true;
  Object.assign(view.rig, {mode: 'orbit', target: [x, y, 0], distance: 5, azimuth: 0.2, elevation: 1.3});
  view.draw();
  measure.choose(tool);
  measure.click(...view.project([x, y, 0]));
  return measure.results.length > before ? measure.results.at(-1).values : [];"""


def rooms():
    """Inner faces x0, x1, y0, y1 of each room and the middle of its door to the hallway, m, as the program's plan has them."""
    found = re.findall(r'\{"(\w+)",([\d., ]+)\}', PLAN.read_text(encoding="utf-8"))
    plan = {name: [float(number) for number in numbers.split(",")] for name, numbers in found}
    plan["bedroom"][3] -= WARDROBE_M
    return plan


def room_errors(url):
    """Of length, width and height of each room: measured less true, m; a size that the tool does not find is off by all of it."""
    driver = page_figures.open_browser(page_support.DESK, draws=False)
    errors = {}
    try:
        driver.get(url)
        page_figures.wait_until_whole(driver)
        for name, (x0, x1, y0, y1, door_x) in rooms().items():
            true = (x1 - x0, y1 - y0, HEIGHT_M)
            found = driver.execute_script(CLICK, door_x, y1 - INSIDE_M if y0 == 0 else y0 + INSIDE_M)
            values = [size["value"] for size in found] if len(found) == 3 else [0, 0, 0]
            errors[name] = [value - size for value, size in zip(values, true)]
    finally:
        driver.quit()
    return errors


def worst(errors):
    return max(abs(error) for sizes in errors.values() for error in sizes)

