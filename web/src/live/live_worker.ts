/** The Worker of `/live`: socket, decoding, open borders, frontiers. Frames go to the page in the order in which they came. */
import { MeshoptDecoder } from "meshoptimizer/decoder";
import type { Frame, GridTile, PageKey } from "../protocol/frames.ts";
import { FrameError } from "../protocol/reader.ts";
import { decodePage, voxelOf, type EncodedPage, type MeshPage } from "../protocol/mesh_page.ts";
import { findOpenEdges, OpenBorders } from "../protocol/open_edges.ts";
import { Frontiers } from "../protocol/frontiers.ts";
import { Outbox } from "./outbox.ts";
import { LiveSession } from "./session.ts";
import { sharedClockMs, type FromWorker, type OpenEdges, type Receipt, type TileFrontiers, type ToWorker } from "./worker_messages.ts";

const COUNTS_EVERY_MS = 1000, BORDERS_EVERY_MS = 100, BORDERS_TAKE_MS = 20, ACKNOWLEDGE_AFTER_MS = 20;
/** A page's open border is found so long after it changed: most of the neighbours that change it too have come by then. */
const BORDERS_AFTER_MS = 1000;
/** Of all borders together one picture is made, from all of them: not more often than this. */
const BORDERS_POSTED_MS = 500;
/** Tiles of the occupancy change with every scan; their frontiers are found so long after the first change. */
const FRONTIERS_AFTER_MS = 300;
const RULES_BROKEN = 4000;  // close code

const scope = self as unknown as DedicatedWorkerGlobalScope;
const post = (message: FromWorker, transfer: Transferable[] = []): void => scope.postMessage(message, transfer);

class LiveLink {
  private readonly session = new LiveSession();
  private readonly outbox = new Outbox(post);
  private borders: OpenBorders | null = null;
  private readonly edgesOf = new Map<string, { version: number }>();
  private readonly staleBorders = new Map<string, { key: PageKey; sinceMs: number }>();
  private foundBorders: OpenEdges[] = [];
  private bordersPostedMs = 0;
  private frontiers = new Frontiers();
  private readonly staleFrontiers = new Map<string, { key: GridTile["key"]; sinceMs: number }>();
  private socket: WebSocket | null = null;
  private retryTimer: ReturnType<typeof setTimeout> | null = null;
  private connection = 0;
  private toAcknowledge = 0;
  private acknowledged = 0;
  private bytes = 0;
  private frames = 0;

  constructor(private readonly url: string) {
    setInterval(() => this.postCounts(), COUNTS_EVERY_MS);
    setInterval(() => this.findBorders(), BORDERS_EVERY_MS);
    setInterval(() => this.findFrontiers(), BORDERS_EVERY_MS);
  }

  connect(): void {
    if (this.retryTimer !== null) clearTimeout(this.retryTimer);
    this.retryTimer = null;
    post({ type: "state", state: "connecting", reason: "", retryS: 0 });
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    ++this.connection;
    this.toAcknowledge = 0;
    this.acknowledged = 0;
    this.session.opened();
    socket.onmessage = event => this.receive(socket, event.data);
    socket.onclose = event => this.lost(socket, event.reason || (event.code === 1006 ? "the server cannot be reached" : `closed, code ${event.code}`));
  }

  retry(): void {
    if (!this.socket) this.connect();
  }

  send(text: string): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(text);
  }

  /** Never backwards: what is not shown because it is no news is acknowledged before what the page still shows. */
  acknowledge({ connection, sequence }: Receipt): void {
    if (connection !== this.connection || sequence <= Math.max(this.acknowledged, this.toAcknowledge)) return;
    if (this.toAcknowledge === 0) setTimeout(() => this.sendAcknowledgement(), ACKNOWLEDGE_AFTER_MS);
    this.toAcknowledge = sequence;
  }

  private sendAcknowledgement(): void {
    if (this.toAcknowledge > 0) this.send(JSON.stringify({ type: "ack", sequence: this.toAcknowledge }));
    this.acknowledged = Math.max(this.acknowledged, this.toAcknowledge);
    this.toAcknowledge = 0;
  }

  private receive(socket: WebSocket, data: unknown): void {
    if (socket !== this.socket) return;
    try {
      if (!(data instanceof ArrayBuffer)) throw new FrameError("a message that is not binary");
      this.bytes += data.byteLength;
      ++this.frames;
      this.accept(new Uint8Array(data));
    } catch (error) {
      this.refuse(socket, (error as Error).message);
    }
  }

  private accept(bytes: Uint8Array): void {
    const { frame, send, cleared } = this.session.receive(bytes);
    const receipt = { connection: this.connection, sequence: this.session.newestSequence };
    if (cleared) this.clear();
    for (const text of send) this.send(text);
    if (frame?.kind === "hello")
      post({ type: "state", state: "open", reason: "", retryS: 0 });
    if (frame) this.show(frame, receipt);
    else this.acknowledge(receipt);
  }

  private show(frame: Frame, receipt: Receipt): void {
    if (frame.kind === "unknown") return;
    const receivedMs = sharedClockMs();
    if (frame.kind !== "meshPage") {
      if (frame.kind === "gridTile") this.setTile(frame.tile);
      if (frame.kind === "pageGone") this.setBorder(frame.gone.key, frame.gone.version, null);
      this.outbox.add({ frame, receivedMs }, receipt);
      return;
    }
    const page = this.decode(frame.page);
    this.borders ??= new OpenBorders(voxelOf(page) / 8);
    // No level moves open edges, so that one level of a version is enough.
    if (this.edgesOf.get(page.key.join())?.version !== page.version) this.setBorder(page.key, page.version, findOpenEdges(page));
    this.outbox.add({ frame: { kind: "meshPage", page }, receivedMs }, receipt, [page.positions.buffer]);
  }

  private decode(encoded: EncodedPage): MeshPage {
    try {
      return decodePage(encoded, MeshoptDecoder);
    } catch (error) {
      this.session.pages.forget(encoded.key);
      throw error;
    }
  }

  private setBorder(key: PageKey, version: number, ends: Float32Array | null): void {
    if (ends) this.edgesOf.set(key.join(), { version });
    else this.edgesOf.delete(key.join());
    const sinceMs = performance.now();
    for (const changed of this.borders?.set(key, ends) ?? []) {
      const name = changed.join();
      if (!this.staleBorders.has(name)) this.staleBorders.set(name, { key: changed, sinceMs });
    }
  }

  /** Those that wait longest, for a share of the time: pages come first. */
  private findBorders(): void {
    const begin = performance.now();
    for (const [name, { key, sinceMs }] of this.staleBorders) {
      if (begin - sinceMs < BORDERS_AFTER_MS || performance.now() - begin > BORDERS_TAKE_MS) break;
      this.staleBorders.delete(name);
      this.foundBorders.push({ key, ends: this.borders!.of(key) });
    }
    if (this.foundBorders.length > 0 && begin - this.bordersPostedMs >= BORDERS_POSTED_MS) this.postBorders(begin);
  }

  private postBorders(nowMs: number): void {
    post({ type: "openEdges", pages: this.foundBorders }, this.foundBorders.map(({ ends }) => ends.buffer));
    this.foundBorders = [];
    this.bordersPostedMs = nowMs;
  }

  private setTile(tile: GridTile): void {
    const sinceMs = performance.now();
    for (const key of this.frontiers.set(tile)) {
      const name = key.join();
      if (!this.staleFrontiers.has(name)) this.staleFrontiers.set(name, { key, sinceMs });
    }
  }

  private findFrontiers(): void {
    const begin = performance.now(), tiles: TileFrontiers[] = [];
    for (const [name, { key, sinceMs }] of this.staleFrontiers) {
      if (begin - sinceMs < FRONTIERS_AFTER_MS || performance.now() - begin > BORDERS_TAKE_MS) break;
      this.staleFrontiers.delete(name);
      tiles.push({ key, ends: this.frontiers.of(key) });
    }
    if (tiles.length > 0) post({ type: "frontiers", tiles }, tiles.map(({ ends }) => ends.buffer));
  }

  private postCounts(): void {
    const { skipped, refused, outdated } = this.session;
    post({ type: "counts", counts: { bytes: this.bytes, frames: this.frames, skipped, refused, outdated } });
  }

  private clear(): void {
    this.borders = null;
    this.edgesOf.clear();
    this.staleBorders.clear();
    this.foundBorders = [];
    this.frontiers = new Frontiers();
    this.staleFrontiers.clear();
    this.outbox.flush();
    post({ type: "cleared" });
  }

  private refuse(socket: WebSocket, reason: string): void {
    socket.close(RULES_BROKEN, reason.slice(0, 100));
    this.lost(socket, reason);
  }

  private lost(socket: WebSocket, reason: string): void {
    if (socket !== this.socket) return;
    this.socket = null;
    this.outbox.flush();
    const retryS = this.session.nextPauseS();
    post({ type: "state", state: "lost", reason, retryS });
    this.retryTimer = setTimeout(() => this.connect(), 1000 * retryS);
  }
}

let link: LiveLink | null = null;
scope.onmessage = async (event: MessageEvent<ToWorker>) => {
  const message = event.data;
  if (message.type === "start") {
    await MeshoptDecoder.ready;
    link = new LiveLink(message.url);
    link.connect();
  } else if (message.type === "shown") link?.acknowledge(message.receipt);
  else if (message.type === "send") link?.send(message.text);
  else link?.retry();
};
