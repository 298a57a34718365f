import type { CommandKind, CommandValues, Holder, Answer, Input } from "./pilot_link.ts";
import type { FromPilotWorker, ToPilotWorker } from "./pilot_worker.ts";

export interface PilotListener {
  onConnected(connected: boolean, reason: string): void;
  onLease(holder: Holder): void;
  onAnswer(answer: Answer): void;
}

const nowMs = (): number => performance.timeOrigin + performance.now();

/** The page's end of the Worker that speaks on `/pilot`. */
export class PilotClient {
  private readonly worker: Worker;

  constructor(workerUrl: string, url: string, private readonly listener: PilotListener) {
    this.worker = new Worker(workerUrl, { type: "module" });
    this.worker.onmessage = (event: MessageEvent<FromPilotWorker>) => this.receive(event.data);
    this.post({ type: "start", url });
  }

  take(force: boolean): void { this.post({ type: "take", force }); }
  release(): void { this.post({ type: "release" }); }
  command(kind: CommandKind, values: CommandValues = {}): void { this.post({ type: "command", kind, atMs: nowMs(), values }); }
  steer(input: Omit<Input, "atMs">): void { this.post({ type: "steer", input: { ...input, atMs: nowMs() } }); }

  private receive(message: FromPilotWorker): void {
    if (message.type === "connected") this.listener.onConnected(message.connected, message.reason);
    else if (message.type === "lease") this.listener.onLease(message.holder);
    else this.listener.onAnswer(message);
  }

  private post(message: ToPilotWorker): void { this.worker.postMessage(message); }
}
