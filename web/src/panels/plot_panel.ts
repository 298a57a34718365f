import uPlot from "uplot";
import type { Statistics, Telemetry } from "../protocol/messages.ts";
import type { Pose } from "../protocol/frames.ts";
import { element, titled } from "./dom.ts";
import type { LinkCounts } from "../live/worker_messages.ts";
import { bytes, count, figure } from "./numbers.ts";
import { cssColor } from "./theme.ts";
import { TimeSeries } from "./time_series.ts";

const HEIGHT_PX = 130, MOST_CURVES = 8, DASHES = [[], [6, 3], [2, 2], [8, 3, 2, 3]];
const PLOTS = {
  height: ["Height", "m"], velocity: ["Velocity", "m/s"], deviation: ["Deviation of the position, 1 sigma", "m"], stages: ["Times of the stages", "ms"],
  rates: ["Rates", "1/s"], counts: ["Dropped and refused", ""], memory: ["Memory", "MB"],
} as const;
type PlotName = keyof typeof PLOTS;

/** One plot: made when it has something to show, made again when curves come or the colours change. */
class Plot {
  readonly box = element("div", { class: "plot", hidden: true });
  readonly series = new TimeSeries();
  private plot: uPlot | null = null;
  private curves = "";

  constructor(private readonly title: string, private readonly unit: string) {}

  draw(widthPx: number): void {
    if (this.series.length < 2 || this.series.names.length === 0) return;
    this.box.hidden = false;
    const names = this.series.names.slice(0, MOST_CURVES), curves = names.join("|") + cssColor("--ink");
    if (!this.plot || curves !== this.curves) this.make(names, widthPx);
    this.curves = curves;
    if (this.plot!.width !== widthPx) this.plot!.setSize({ width: widthPx, height: HEIGHT_PX });
    this.plot!.setData(this.series.table().slice(0, MOST_CURVES + 1) as unknown as uPlot.AlignedData);
  }

  private make(names: string[], width: number): void {
    this.plot?.destroy();
    const ink = cssColor("--soft"), grid = { stroke: cssColor("--edge"), width: 1 }, ticks = { ...grid, size: 4 };
    const curves = names.map((label, i) => ({
      label, stroke: cssColor(`--s${i % 8}`), width: 1.6, dash: DASHES[Math.floor(i / 2) % 4], spanGaps: true,
      value: (plot: uPlot, value: number | null, series: number, index: number | null) => figure(index === null ? newest(plot.data[series]) : value),
    }));
    const axis = { stroke: ink, grid, ticks, font: "11px system-ui", gap: 3 };
    this.box.replaceChildren(element("h3", {}, this.unit ? `${this.title} (${this.unit})` : this.title));
    this.plot = new uPlot({
      width, height: HEIGHT_PX, scales: { x: { time: false } }, legend: { live: true }, cursor: { y: false, sync: { key: "housemartin" } },
      axes: [{ ...axis, size: 24 }, { ...axis, size: 46, space: 24 }], series: [{ label: "time", value: (plot: uPlot, value: number | null, _: number, index: number | null) => figure(index === null ? newest(plot.data[0]) : value, "s") }, ...curves],
    }, this.series.table().slice(0, names.length + 1) as unknown as uPlot.AlignedData, this.box);
  }
}

/** What the legend shows while the pointer is elsewhere. */
function newest(column: ArrayLike<number | null | undefined>): number | null {
  for (let i = column.length - 1; i >= 0; --i) if (column[i] !== null && column[i] !== undefined) return column[i]!;
  return null;
}

const listed = (rows: string[][]): HTMLElement[] => rows.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]);

/** Curves of what the server measures, counts, and the parameters in effect. */
export class PlotPanel {
  readonly page = element("div");
  private readonly plots = Object.fromEntries(Object.entries(PLOTS).map(([name, [title, unit]]) => [name, new Plot(title, unit)])) as Record<PlotName, Plot>;
  private readonly counts = element("dl", { class: "values" });
  private readonly link = element("dl", { class: "values", id: "link-counts" });
  private readonly parameters = element("pre");
  private readonly parameterBox = element("details", { hidden: true }, element("summary", {}, "Parameters in effect"), this.parameters);
  private shown = false;
  private vehicleSeen = false;

  constructor() {
    this.page.append(...Object.values(this.plots).map(plot => plot.box), titled("Numbers", this.counts), titled("This page", this.link), this.parameterBox);
    new ResizeObserver(() => this.draw()).observe(this.page);
  }

  setShown(shown: boolean): void {
    this.shown = shown;
    requestAnimationFrame(() => this.draw());
  }

  telemetry(timeS: number, { vehicle }: Telemetry): void {
    if (!vehicle) return;
    this.vehicleSeen = true;
    this.plots.height.series.add(timeS, { height: vehicle.height_m, floor: vehicle.floor_m });
    const [x, y, z] = vehicle.velocity_m_s ?? [];
    this.plots.velocity.series.add(timeS, { speed: vehicle.speed_m_s, ...(vehicle.velocity_m_s ? { x, y, z } : {}) });
  }

  pose(timeS: number, pose: Pose): void {
    this.plots.deviation.series.add(timeS, { [pose.which]: pose.deviationM });
    if (!this.vehicleSeen && pose.which === "camera") this.plots.height.series.add(timeS, { camera: pose.position[2] });
  }

  statistics(timeS: number, { stages, rates, counts, memory, parameters }: Statistics): void {
    if (stages) this.plots.stages.series.add(timeS, stages);
    if (rates) this.plots.rates.series.add(timeS, rates);
    if (counts) this.plots.counts.series.add(timeS, counts);
    if (memory) this.plots.memory.series.add(timeS, Object.fromEntries(Object.entries(memory).map(([name, value]) => [name, value === null ? null : value / 1e6])));
    if (parameters) {
      this.parameters.textContent = parameters;
      this.parameterBox.hidden = false;
    }
    if (!counts && !memory) return;
    const rows = [...Object.entries(counts ?? {}).map(([name, value]) => [name, String(value ?? "-")]),
                  ...Object.entries(memory ?? {}).map(([name, value]) => [name, value === null ? "-" : bytes(value)])];
    if (this.shown) this.counts.replaceChildren(...listed(rows));
  }

  /** What this page received, and what it did not take. */
  received({ bytes: size, frames, skipped, refused, outdated }: LinkCounts): void {
    this.link.replaceChildren(...listed([["received", bytes(size)], ["frames", count(frames)], ["of unknown kinds, skipped", String(skipped)],
                                         ["against the rules, refused", String(refused)], ["older than what is there, left out", String(outdated)]]));
  }

  draw(): void {
    const width = this.page.clientWidth;
    if (this.shown && width > 0) Object.values(this.plots).forEach(plot => plot.draw(width));
  }
}
