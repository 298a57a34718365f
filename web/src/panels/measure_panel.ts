import { TOOLS, type MeasureTool } from "../measure/measure_tool.ts";
import { byId, element, titled } from "./dom.ts";

const REPORT = "report";

/** Tools, results, and what can be saved. */
export class MeasurePanel {
  readonly page = element("div");
  private readonly tools = new Map<string, HTMLButtonElement>();
  private readonly list = element("ul", { class: "results" });
  private readonly close = element("button", { type: "button", class: "main", onclick: () => this.measure.close() }, "Close the area");
  private readonly links = element("div", { class: "buttons" });

  constructor(private readonly measure: MeasureTool, savePicture: () => void) {
    const row = element("div", { class: "buttons" });
    for (const tool of TOOLS) {
      const button = element("button", { type: "button", "aria-pressed": "false", onclick: () => measure.choose(measure.tool === tool ? null : tool) }, tool);
      this.tools.set(tool, button);
      row.append(button);
    }
    this.page.append(
      titled("Measure", row, this.close, this.list,
             element("p", { class: "soft" }, "Points lie on the surface. ± is one standard deviation: the expected error of the surface, the voxel size where it is unknown, and what a pixel covers.")),
      titled("Save", this.links, element("div", { class: "buttons" }, element("button", { type: "button", onclick: savePicture }, "Picture of this view"))));
    measure.onChange = () => this.update();
    this.update();
  }

  /** What the server offers under /api. */
  setExports(names: string[], query: string): void {
    this.links.replaceChildren(...names.map(name => element("a", { class: "button", href: `api/${name}${query}`, download: name === REPORT ? "report.html" : name,
                                                                   "data-name": name, hidden: name === REPORT }, name)));
  }

  /** A run writes its report at its end. */
  setEnded(ended: boolean): void {
    const report = this.links.querySelector<HTMLElement>(`[data-name=${REPORT}]`);
    if (report) report.hidden = !ended;
  }

  private update(): void {
    const { tool, hint, results, canClose } = this.measure;
    for (const [name, button] of this.tools) {
      button.setAttribute("aria-pressed", String(name === tool));
      button.classList.toggle("main", name === tool);
    }
    byId("stage").dataset.tool = tool ?? "";
    byId("hint").hidden = !tool;
    byId("hint").textContent = hint;
    this.close.hidden = !canClose;
    this.list.replaceChildren(...results.map(({ id, tool: name, texts }) => element("li", {},
      element("span", {}, element("span", { class: "soft" }, name), ...texts.map(text => element("div", {}, element("b", {}, text)))),
      element("button", { type: "button", "aria-label": `remove this ${name}`, onclick: () => this.measure.remove(id) }, "✕"))));
  }
}
