const SVG = "http://www.w3.org/2000/svg", WIDTH = 88, HEIGHT = 32;
/** Centres of the states (docs/flight.md, States). */
const PLACES: Record<string, [number, number]> = {
  off: [54, 30], engaging: [165, 30], idle: [276, 30], disengaging: [165, 88], flying: [276, 146], landing: [165, 146], error: [54, 146],
};
const WAYS = [
  "M98 30H118", "M209 30H229",            // off, engaging, idle
  "M240 47 206 71", "M121 76 80 49",      // idle, disengaging, off
  "M284 46V128", "M232 146H212", "M196 130 262 48",  // idle, flying, landing, idle
  "M46 130V48",                           // error, off
];

const make = (tag: string, attributes: Record<string, string | number>, text = ""): SVGElement => {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  made.textContent = text;
  return made;
};

/** "kTakeOff", "take_off" and "take-off" in the same words. */
export const plainState = (name: string): string => name.replace(/[_-]/g, " ").toLowerCase().trim();

/** The state machine of the autopilot with the present state filled; what it does within it stands below its name. */
export class MachineDrawing {
  readonly svg = make("svg", { viewBox: "0 0 330 176", class: "machine", role: "img", "aria-label": "States of the autopilot" });
  private readonly boxes = new Map<string, SVGElement>();

  constructor() {
    const defs = make("defs", {}), marker = make("marker", { id: "arrow", viewBox: "0 0 8 8", refX: 7, refY: 4, markerWidth: 7, markerHeight: 7, orient: "auto" });
    marker.append(make("path", { d: "M0 0 8 4 0 8Z" }));
    defs.append(marker);
    this.svg.append(defs, ...WAYS.map(d => make("path", { d, "marker-end": "url(#arrow)" })));
    for (const [name, [x, y]] of Object.entries(PLACES)) {
      const box = make("g", { class: name });
      box.append(make("rect", { x: x - WIDTH / 2, y: y - HEIGHT / 2, width: WIDTH, height: HEIGHT, rx: 8 }), make("text", { x, y: y + 4 }, name));
      this.boxes.set(name, box);
      this.svg.append(box);
    }
  }

  show(state: string, phase: string): void {
    const present = plainState(state), words = plainState(phase);
    for (const [name, box] of this.boxes) {
      const now = name === present, text = box.querySelector("text")!;
      box.setAttribute("class", now ? `${name} now` : name);
      text.textContent = now && words && !words.endsWith("ground") ? words : name;
    }
    this.svg.setAttribute("aria-label", `State of the autopilot: ${present}${words ? `, ${words}` : ""}`);
  }
}
