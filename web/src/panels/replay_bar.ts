import type { Replay } from "../protocol/messages.ts";
import { byId, element } from "./dom.ts";
import { clock } from "./numbers.ts";

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8];

/** Pause, speed and place of a replay. */
export class ReplayBar {
  private readonly play = element("button", { type: "button", class: "icon", "aria-label": "Pause or go on" }, "❚❚");
  private readonly slider = element("input", { type: "range", min: 0, max: 1000, value: 0, "aria-label": "Place in the recording" });
  private readonly speed = element("select", { "aria-label": "Speed" }, ...SPEEDS.map(value => element("option", { value, selected: value === 1 }, `${value}×`)));
  private readonly time = element("span", { class: "time" });
  private state: Replay | null = null;
  private held = false;

  constructor(private readonly request: (change: { paused?: boolean; speed?: number; seek_s?: number }) => void) {
    this.play.addEventListener("click", () => this.toggle());
    this.speed.addEventListener("change", () => request({ speed: Number(this.speed.value) }));
    this.slider.addEventListener("input", () => { this.held = true; this.showTime(this.chosenS()); });
    this.slider.addEventListener("change", () => { this.held = false; request({ seek_s: this.chosenS() }); });
    byId("replay").append(this.play, this.slider, this.time, this.speed);
  }

  toggle(): void {
    if (this.state) this.request({ paused: !this.state.paused });
  }

  update(replay: Replay | undefined): void {
    byId("replay").hidden = !replay;
    if (!replay) return;
    this.state = replay;
    this.play.textContent = replay.paused ? "▶" : "❚❚";
    if (document.activeElement !== this.speed) this.speed.value = String(replay.speed);
    if (this.held) return;
    this.slider.value = String(1000 * (replay.time_s - replay.begin_s) / Math.max(replay.end_s - replay.begin_s, 1e-9));
    this.showTime(replay.time_s);
  }

  private chosenS(): number {
    const { begin_s, end_s } = this.state ?? { begin_s: 0, end_s: 0 };
    return begin_s + Number(this.slider.value) / 1000 * (end_s - begin_s);
  }

  private showTime(timeS: number): void {
    const { begin_s, end_s } = this.state ?? { begin_s: 0, end_s: 0 };
    this.time.textContent = `${clock(timeS - begin_s)} / ${clock(end_s - begin_s)}`;
  }
}
