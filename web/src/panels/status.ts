import type { Pose } from "../protocol/frames.ts";
import type { Hello, Telemetry } from "../protocol/messages.ts";
import type { LinkState } from "../live/live_client.ts";
import { byId, element } from "./dom.ts";
import { clock, count, figure } from "./numbers.ts";

const MARKS = { ok: "✓", warning: "!", bad: "✕" };
const URGENCY = { bad: 0, warning: 1, ok: 2 };  // a small phone on its side shows the first word only
const VERDICT_LEVELS: Record<string, keyof typeof MARKS> = { ok: "ok", doubtful: "warning", broken: "bad" };

/** The header and the words over the model: what a person who scans has to know now. */
export class Status {
  private telemetry: Telemetry = {};
  private lost = false;

  constructor(private readonly onRetry: () => void) {}

  hello({ source, program }: Hello): void {
    byId("source").textContent = source.name || "housemartin";
    byId("program").textContent = `${source.verb} · ${program}`;
    document.title = `${source.name} · housemartin`;
  }

  link({ state, reason, retryS }: LinkState): void {
    const pill = byId("link"), banner = byId("banner");
    pill.dataset.state = state;
    pill.textContent = state === "open" ? "live" : state === "lost" ? "lost" : "connecting";
    if (state === "connecting") return;
    banner.hidden = state === "open";
    if (state === "lost")
      banner.replaceChildren(element("strong", {}, "The server is lost. "), `${reason}. What is here stays; next attempt in ${Math.ceil(retryS)} s. `,
                             element("button", { type: "button", onclick: this.onRetry }, "Try now"));
  }

  update(telemetry: Telemetry): void {
    this.telemetry = telemetry;
    this.showWords();
    this.showProgress();
  }

  /** Size of the model and of what is still open. */
  size({ triangles, openM, frontierM, voxelM }: { triangles: number; openM: number; frontierM: number; voxelM: number }): void {
    const { coverage } = this.telemetry, parts: [string, string][] = [];
    if (coverage?.area_m2 != null) parts.push([figure(coverage.area_m2), "m² seen"]);
    if (coverage?.share != null) parts.push([figure(100 * coverage.share), "% covered"]);
    if (openM > 0) parts.push([figure(openM), "m of open borders"]);
    if (frontierM > 0) parts.push([figure(frontierM), "m of frontiers"]);
    if (triangles > 0) parts.push([count(triangles), "triangles"]);
    if (voxelM > 0) parts.push([figure(100 * voxelM), "cm voxels"]);
    byId("coverage").replaceChildren(...parts.map(([value, unit]) => element("div", {}, element("b", {}, value), ` ${unit}`)));
  }

  pose(pose: Pose): void {
    this.lost = pose.state === "lost";
    if (!this.telemetry.words?.length) this.showWords();
  }

  private showWords(): void {
    const words = [...this.telemetry.words ?? []], { verdict, state, reason } = this.telemetry;
    // Without telemetry at least the pose says whether it is lost.
    if (words.length === 0 && this.lost && !verdict) words.push({ level: "bad", text: "Lost: go back to what is already in the model" });
    if (state === "failed") words.unshift({ level: "bad", text: "Failed", number: reason || "the run told no reason" });
    if (verdict) words.push({ level: VERDICT_LEVELS[verdict.verdict] ?? "bad", text: `Result: ${verdict.verdict}`, number: verdict.reasons?.join("; ") ?? "" });
    this.draw(words.sort((one, other) => URGENCY[one.level] - URGENCY[other.level]));
  }

  private draw(words: NonNullable<Telemetry["words"]>): void {
    byId("words").replaceChildren(...words.slice(0, 3).map(word => element("div", { class: "word", "data-level": word.level },
      element("span", { class: "mark", "aria-hidden": "true" }, MARKS[word.level] ?? "·"),
      element("span", {}, element("strong", {}, word.text), word.number != null && word.number !== "" ? element("span", { class: "number" }, String(word.number)) : ""))));
  }

  private showProgress(): void {
    const { progress, replay, state } = this.telemetry, box = byId("progress");
    box.hidden = !progress && !state;
    const share = progress && progress.total > 0 ? Math.min(progress.done / progress.total, 1) : 0;
    (box.querySelector(".bar") as HTMLElement).style.width = `${100 * share}%`;
    const words = progress && progress.total > 0 ? `${progress.stage ?? ""} ${progress.done} of ${progress.total}` : state ?? "";
    box.querySelector(".text")!.textContent = state === "finished" ? "finished" : replay?.paused ? `paused at ${clock(replay.time_s - replay.begin_s)}` : words;
  }
}
