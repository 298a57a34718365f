import type { FromWorker, Receipt, TimedFrame } from "./worker_messages.ts";

const WAIT_MS = 5, MOST_FRAMES = 50;

/**
 * Frames on their way from the Worker to the page. Pages of the mesh go in parcels: for a small page a message of its own
 * takes longer than all else that is done with it. Whatever else comes goes at once, behind the pages before it.
 */
export class Outbox {
  private frames: TimedFrame[] = [];
  private transfer: Transferable[] = [];
  private receipt: Receipt | null = null;
  private timer: ReturnType<typeof setTimeout> | null = null;

  constructor(private readonly post: (message: FromWorker, transfer: Transferable[]) => void) {}

  /** `buffers`: of the frame, handed over to the page. */
  add(timed: TimedFrame, receipt: Receipt, buffers: Transferable[] = []): void {
    this.frames.push(timed);
    this.transfer.push(...buffers);
    this.receipt = receipt;
    if (timed.frame.kind !== "meshPage" || this.frames.length >= MOST_FRAMES) this.flush();
    else this.timer ??= setTimeout(() => this.flush(), WAIT_MS);
  }

  flush(): void {
    if (this.timer !== null) clearTimeout(this.timer);
    this.timer = null;
    if (this.receipt) this.post({ type: "frames", receipt: this.receipt, frames: this.frames }, this.transfer);
    this.frames = [];
    this.transfer = [];
    this.receipt = null;
  }
}
