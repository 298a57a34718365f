import type { FromWorker, LinkCounts, OpenEdges, Receipt, ShownFrame, TileFrontiers, ToWorker } from "./worker_messages.ts";

export interface LinkState { state: "connecting" | "open" | "lost"; reason: string; retryS: number }

export interface LiveListener {
  /** A frame, and when it was received (sharedClockMs). */
  onFrame(frame: ShownFrame, receivedMs: number): void;
  onOpenEdges(pages: readonly OpenEdges[]): void;
  onFrontiers(tiles: readonly TileFrontiers[]): void;
  /** What is shown belongs to a session that has ended: all of it goes. */
  onCleared(): void;
  onState(state: LinkState): void;
  onCounts(counts: LinkCounts): void;
}

/** The page's end of the Worker that reads `/live`. Acknowledges what has been shown, so that a slow page slows the server. */
export class LiveClient {
  private readonly worker: Worker;
  private newest: Receipt | null = null;

  constructor(workerUrl: string, private readonly url: string, private readonly listener: LiveListener) {
    this.worker = new Worker(workerUrl, { type: "module" });
    this.worker.onmessage = (event: MessageEvent<FromWorker>) => this.receive(event.data);
  }

  start(): void { this.post({ type: "start", url: this.url }); }
  retry(): void { this.post({ type: "retry" }); }
  send(message: object): void { this.post({ type: "send", text: JSON.stringify(message) }); }

  private receive(message: FromWorker): void {
    switch (message.type) {
      case "frames":
        for (const { frame, receivedMs } of message.frames) this.listener.onFrame(frame, receivedMs);
        this.shown(message.receipt);
        break;
      case "openEdges": this.listener.onOpenEdges(message.pages); break;
      case "frontiers": this.listener.onFrontiers(message.tiles); break;
      case "cleared": this.listener.onCleared(); break;
      case "state": this.listener.onState(message); break;
      case "counts": this.listener.onCounts(message.counts); break;
    }
  }

  /** One acknowledgement for all frames of a burst. */
  private shown(receipt: Receipt): void {
    if (this.newest === null)
      setTimeout(() => {
        this.post({ type: "shown", receipt: this.newest! });
        this.newest = null;
      }, 10);
    this.newest = receipt;
  }

  private post(message: ToWorker): void { this.worker.postMessage(message); }
}
