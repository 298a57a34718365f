/** A picture that something waits for should be finished after so long; one finished faster than the other allows finer ones. */
const SLOW_MS = 100, FAST_MS = 34;
/** A picture of what rests is drawn again, finer, after so long. */
const REST_MS = 250;
const MOST_STEPS = 6;

/**
 * How coarse pictures are where graphics are slow: coarser while something changes and pictures take long, finer again,
 * picture by picture, when nothing does. Times in ms on one clock.
 */
export class DetailPace {
  private changingStep = 0;  // half a step: sides of triangles 1.4 times as long, half as many of them
  private drawnStep = 0;
  private isChanging = false;
  private begunMs = 0;
  private finishedMs = 0;

  /** A picture begins, if one has to be drawn: how many times as long as fine ones the sides of its triangles may be; else null. */
  begin(isChanged: boolean, nowMs: number): number | null {
    if (!isChanged && (this.drawnStep === 0 || nowMs - this.finishedMs < REST_MS)) return null;
    this.drawnStep = isChanged ? this.changingStep : Math.max(this.drawnStep - 2, 0);
    this.isChanging = isChanged;
    this.begunMs = nowMs;
    return 2 ** (this.drawnStep / 2);
  }

  /** That picture is finished. */
  finished(nowMs: number): void {
    const tookMs = nowMs - this.begunMs;
    this.finishedMs = nowMs;
    if (!this.isChanging) return;
    if (tookMs > SLOW_MS) this.changingStep += Math.ceil(Math.log2(tookMs / SLOW_MS));
    else if (tookMs < FAST_MS) --this.changingStep;
    this.changingStep = Math.min(Math.max(this.changingStep, 0), MOST_STEPS);
  }
}
