/** A picture that something waits for should be finished after so long; one finished faster than the other allows finer ones. */
const SLOW_MS = 100, FAST_MS = 34;
/** A picture of what rests is drawn again, finer, after so long. */
const REST_MS = 250;
const MOST_STEPS = 6;

/** Why a picture has to be drawn: more of the model has come, which may wait a moment; or something that somebody waits for. */
export type Change = "none" | "grown" | "moved";

/**
 * How coarse pictures are where graphics are slow: coarser while something changes and pictures take long, finer again,
 * picture by picture, when nothing does. Pictures of a model that only grows take half of the time at most: what draws them
 * may be what the rest of the model needs to arrive. Times in ms on one clock.
 */
export class DetailPace {
  private changingStep = 0;  // half a step: sides of triangles 1.4 times as long, half as many of them
  private drawnStep = 0;
  private isChanging = false;
  private begunMs = 0;
  private finishedMs = 0;
  private tookMs = 0;

  /** A picture begins, if one has to be drawn: how many times as long as fine ones the sides of its triangles may be; else null. */
  begin(change: Change, nowMs: number): number | null {
    const isChanged = change !== "none", restedMs = nowMs - this.finishedMs;
    if (!isChanged && (this.drawnStep === 0 || restedMs < REST_MS)) return null;
    if (change === "grown" && restedMs < Math.min(this.tookMs, REST_MS)) return null;
    this.drawnStep = isChanged ? this.changingStep : Math.max(this.drawnStep - 2, 0);
    this.isChanging = isChanged;
    this.begunMs = nowMs;
    return 2 ** (this.drawnStep / 2);
  }

  /** That picture is finished. */
  finished(nowMs: number): void {
    this.tookMs = nowMs - this.begunMs;
    this.finishedMs = nowMs;
    if (!this.isChanging) return;
    if (this.tookMs > SLOW_MS) this.changingStep += Math.ceil(Math.log2(this.tookMs / SLOW_MS));
    else if (this.tookMs < FAST_MS) --this.changingStep;
    this.changingStep = Math.min(Math.max(this.changingStep, 0), MOST_STEPS);
  }
}
