import { COLOR_MAP, COLOR_MODES, OLDEST_S, type ColorMode } from "../mesh/mesh_shader.ts";
import { LAYERS, type SceneView } from "../scene/scene_view.ts";
import type { RayLimits } from "../measure/raycast.ts";
import { UNSEEN_COLOR } from "../scene/open_edge_layer.ts";
import { choice, element, titled, toggle } from "./dom.ts";
import { length } from "./numbers.ts";

/** What is drawn over the model, by colour and by form: a line where nobody has looked yet, areas of what is known. */
function legendOfMarks(): HTMLElement {
  const marks: [string, string, string][] = [
    ["line", UNSEEN_COLOR, "not seen beyond: open borders, frontiers"], ["area", "#8fcaf2", "free"], ["area", "#d95414", "occupied"],
  ];
  return element("div", { class: "legend marks" }, ...marks.map(([form, color, words]) => {
    const mark = element("i", { class: form, "aria-hidden": "true" });
    mark.style.background = color;
    return element("span", {}, mark, words);
  }));
}

/** Colours, clipping height, what is shown. */
export class ViewPanel {
  readonly page = element("div");
  private readonly legend = element("div", { class: "legend" });
  private readonly modes = choice("Colours", COLOR_MODES, "colour", mode => this.setMode(mode));
  private readonly clip = element("input", { type: "range", id: "clip", min: 0, max: 100, value: 100, "aria-label": "Clipping height" });
  private readonly clipText = element("output", { for: "clip" }, "whole model");
  private heights: [number, number] = [0, 3];
  private mode: ColorMode = "colour";
  private clipHeightM = Infinity;
  private backSides = false;

  constructor(private readonly view: SceneView) {
    this.clip.addEventListener("input", () => this.applyClip());
    const hidden = new Set(["truth"]);
    hidden.forEach(layer => view.setVisible(layer as (typeof LAYERS)[number], false));
    this.page.append(
      titled("Colours", this.modes.row, this.legend),
      titled("Roof off", element("div", { class: "slider" }, this.clip, this.clipText),
             toggle("back sides too", false, both => this.setBackSides(both))),
      titled("Shown", element("div", { class: "toggles" }, ...LAYERS.map(layer => toggle(layer, !hidden.has(layer), on => view.setVisible(layer, on)))),
             legendOfMarks()));
    this.showLegend();
  }

  /** The model's lowest and highest point, m; floors and ceilings may be added while it grows. */
  setHeights(low: number, high: number): void {
    if (Math.abs(low - this.heights[0]) < 0.01 && Math.abs(high - this.heights[1]) < 0.01) return;
    this.heights = [low, high];
    this.view.mesh.heights = [low, high];
    this.applyClip();
    this.showLegend();
  }

  /** What of the model is seen, and so met by a ray. */
  get limits(): RayLimits { return { clipHeightM: this.clipHeightM, backSides: this.backSides }; }

  nextMode(): void { this.setMode(COLOR_MODES[(COLOR_MODES.indexOf(this.mode) + 1) % COLOR_MODES.length]); }

  setMode(mode: ColorMode): void {
    this.mode = mode;
    this.modes.choose(mode);
    this.view.mesh.mode = mode;
    this.view.requestDraw();
    this.showLegend();
  }

  private setBackSides(both: boolean): void {
    this.backSides = both;
    this.view.mesh.bothSides = both;
    this.view.requestDraw();
  }

  private applyClip(): void {
    const share = Number(this.clip.value) / 100, [low, high] = this.heights;
    this.clipHeightM = share >= 1 ? Infinity : low + share * (high - low);
    this.clipText.textContent = share >= 1 ? "whole model" : `up to ${length(this.clipHeightM)}`;
    this.view.mesh.clipHeightM = this.clipHeightM;
    for (const { lines } of [this.view.openEdges, this.view.frontiers]) lines.setClipHeight(this.clipHeightM);
    this.view.requestDraw();
  }

  private showLegend(): void {
    const [low, high] = this.heights;
    const ends: Record<ColorMode, [string, string] | null> = {
      colour: null, normals: null, height: [length(low), length(high)],
      age: [`${OLDEST_S / 60} min ago`, "now"], error: ["0 cm", "2 cm or more"],
    };
    const shown = ends[this.mode];
    this.legend.hidden = !shown;
    if (!shown) return;
    const stripes = COLOR_MAP.map(color => {
      const stripe = element("i");
      stripe.style.background = `#${color}`;
      return stripe;
    });
    this.legend.replaceChildren(element("span", {}, shown[0]), element("div", { class: "map" }, ...stripes), element("span", {}, shown[1]));
  }
}
