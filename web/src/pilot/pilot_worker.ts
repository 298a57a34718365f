/** The Worker of `/pilot`: drawing cannot delay it, and it cannot fly on its own: without inputs from the page it sends no velocity. */
import { PilotLink, type Answer, type CommandKind, type CommandValues, type Holder, type Input } from "./pilot_link.ts";

export type ToPilotWorker =
  | { type: "start"; url: string }
  | { type: "take"; force: boolean }
  | { type: "release" }
  | { type: "command"; kind: CommandKind; atMs: number; values: CommandValues }
  | { type: "steer"; input: Input };
export type FromPilotWorker =
  | { type: "connected"; connected: boolean; reason: string }
  | { type: "lease"; holder: Holder }
  | ({ type: "answer" } & Answer);

const TICK_MS = 50, RETRY_MS = 1000;
const scope = self as unknown as DedicatedWorkerGlobalScope;
const post = (message: FromPilotWorker): void => scope.postMessage(message);

let socket: WebSocket | null = null;
// The same clock in the page and in its Workers.
const link = new PilotLink(text => { if (socket?.readyState === WebSocket.OPEN) socket.send(text); }, () => performance.timeOrigin + performance.now());

function connect(url: string): void {
  const opened = new WebSocket(url);
  socket = opened;
  opened.onopen = () => {
    link.opened();
    post({ type: "connected", connected: true, reason: "" });
  };
  opened.onmessage = event => {
    try {
      const news = link.receive(String(event.data));
      if (news) post(news);
    } catch {
      opened.close(4000, "no JSON object");
    }
  };
  opened.onclose = event => {
    link.opened();
    post({ type: "lease", holder: "none" });
    post({ type: "connected", connected: false, reason: event.reason || "the server cannot be reached" });
    setTimeout(() => connect(url), RETRY_MS);
  };
}

scope.onmessage = (event: MessageEvent<ToPilotWorker>) => {
  const message = event.data;
  switch (message.type) {
    case "start":
      connect(message.url);
      setInterval(() => link.tick(), TICK_MS);
      break;
    case "take": link.take(message.force); break;
    case "release": link.release(); break;
    case "command": link.command(message.kind, message.atMs, message.values); break;
    case "steer": link.steer(message.input); break;
  }
};
