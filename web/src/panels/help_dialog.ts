import { byId, element } from "./dom.ts";

const KEYS: [string[], string][] = [
  [["?"], "this help"], [["1", "2", "3", "4"], "orbit, walk, follow, plan"], [["F"], "the whole model"], [["C"], "next colours"], [["M"], "measure a distance"],
  [["Enter"], "choose the point at the crosshair, which keys show while a tool is active; twice: close the area"], [["Esc"], "leave a tool"], [["←", "→", "↑", "↓"], "turn (the model is in focus)"], [["W", "A", "S", "D"], "move; E and Q: up and down"], [["+", "−"], "nearer, further"],
  [["P"], "pause or go on (replay)"], [["L"], "light or dark"], [["Space"], "emergency stop, where there is a vehicle to fly"],
];

/** Keys and gestures. */
export function startHelp(): () => void {
  const dialog = byId<HTMLDialogElement>("help-dialog");
  const rows = KEYS.map(([keys, words]) => element("tr", {}, element("td", {}, ...keys.flatMap((key, i) => [i ? " " : "", element("kbd", {}, key)])), element("td", {}, words)));
  dialog.append(element("h1", {}, "Keys and gestures"), element("table", {}, element("tbody", {}, ...rows)),
    element("p", {}, "Mouse: drag turns, right button or Shift moves, wheel zooms to what is under the pointer, double click turns about it. " +
                     "Touch: one finger turns, two fingers move and zoom. In walk a double click on a floor goes there."),
    element("p", {}, "Pink lines are where nobody has looked yet: open borders (holes of the model) and, thicker, frontiers (free cells of the occupancy beside unknown ones)."),
    element("button", { type: "button", class: "main", autofocus: true, onclick: () => dialog.close() }, "Close"));
  const open = (): void => { if (!dialog.open) dialog.showModal(); };
  byId("help").addEventListener("click", open);
  return open;
}
