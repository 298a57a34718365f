/** A server for tests of the page: the protocol of the live view with the made-up house, on node's own HTTP and `ws`. */
import { createServer, type IncomingMessage, type ServerResponse } from "node:http";
import type { AddressInfo } from "node:net";
import { parseArgs } from "node:util";
import { MeshoptEncoder } from "meshoptimizer";
import { WebSocketServer, type WebSocket } from "ws";
import * as encode from "./encode.ts";
import { makeHouse, type HousePage } from "./house.ts";
import { MadeUpVehicle, type PilotCommand } from "./made_up_vehicle.ts";
import { cameraAt, distanceTo, lookAlong, occupancyTile, pictureAt, statisticsAt, telemetryAt, trajectory } from "./made_up_scan.ts";

const HELP = `node testing/fixture.mjs [--port N] [--grow SECONDS] [--voxel M] [--step M] [--session NAME] [--pilot] [--replay]
Serves the page with a made-up house on 127.0.0.1; the house grows for so many seconds (0: it is all there).`;
const HEADERS = {
  "Content-Security-Policy": "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; img-src 'self' blob: data:; worker-src 'self' blob:; connect-src 'self' ws: wss:",
  "X-Content-Type-Options": "nosniff",
};
const TYPES: Record<string, string> = { js: "text/javascript", css: "text/css", html: "text/html", svg: "image/svg+xml" };

interface Viewer { socket: WebSocket; sequence: number; ready: boolean; known: Map<string, number>; acknowledged: number }
interface ShownPage { page: HousePage; version: number }

class Fixture {
  readonly vehicle: MadeUpVehicle | null;
  readonly sent = { pages: 0, hellos: 0, knownPages: 0, messages: 0, house: 0, triangles: 0 };
  private readonly viewers = new Set<Viewer>();
  private readonly pilots = new Set<WebSocket>();
  private holder: WebSocket | null = null;
  private readonly shown = new Map<string, ShownPage>();
  private readonly replay = { paused: false, speed: 1 };
  private timeS = 0;
  private events = 0;
  private readonly sideM: number;

  constructor(private readonly house: HousePage[], private readonly options: { growS: number; voxelM: number; session: string; pilot: boolean; replay: boolean }) {
    this.sideM = 32 * options.voxelM;
    this.sent.house = house.length;
    this.sent.triangles = house.reduce((sum, { levels }) => sum + levels[0].indices.length / 3, 0);
    this.vehicle = options.pilot ? new MadeUpVehicle() : null;
    this.reveal();
    setInterval(() => this.step(0.05), 50);
    setInterval(() => this.reveal(), 200);
    setInterval(() => this.publishState(), 200);
  }

  /** A viewer connects to `/live`. */
  view(socket: WebSocket): void {
    const viewer: Viewer = { socket, sequence: 0, ready: false, known: new Map(), acknowledged: 0 };
    this.viewers.add(viewer);
    socket.on("close", () => this.viewers.delete(viewer));
    socket.on("message", data => this.read(viewer, JSON.parse(String(data))));
    this.send(viewer, encode.hello({
      protocol: 1, session: this.options.session, program: "made up", source: { verb: "scan", name: "Made-up house" },
      can: { pilot: this.options.pilot, replay: this.options.replay, exports: ["mesh.ply", "mesh.glb", "plan.svg"] }, limits: { in_bytes: 65536, in_per_s: 100 },
    }));
  }

  /** A pilot connects to `/pilot`. */
  pilot(socket: WebSocket): void {
    this.pilots.add(socket);
    socket.on("close", () => {
      this.pilots.delete(socket);
      if (this.holder === socket) this.give(null);
    });
    socket.on("message", data => this.order(socket, JSON.parse(String(data))));
    this.tellLease();
  }

  private get share(): number { return this.options.growS > 0 ? Math.min(this.timeS / this.options.growS, 1) : 1; }

  private read(viewer: Viewer, message: { type: string; session?: string; pages?: number[]; more?: boolean; sequence?: number; paused?: boolean; speed?: number; seek_s?: number }): void {
    ++this.sent.messages;
    if (message.type === "ack") viewer.acknowledged = message.sequence!;
    if (message.type === "replay") {
      Object.assign(this.replay, message.paused === undefined ? {} : { paused: message.paused }, message.speed === undefined ? {} : { speed: message.speed });
      this.timeS = message.seek_s ?? this.timeS;
    }
    if (message.type !== "hello") return;
    ++this.sent.hellos;
    if (message.session === this.options.session) {
      const pages = message.pages ?? [];
      for (let i = 0; i < pages.length; i += 5) viewer.known.set(pages.slice(i, i + 3).join(), pages[i + 3]);
      this.sent.knownPages = viewer.known.size;
    }
    if (!message.more) this.greet(viewer);
  }

  private greet(viewer: Viewer): void {
    viewer.ready = true;
    for (const shown of this.shown.values())
      if (viewer.known.get(shown.page.key.join()) !== shown.version) this.sendPage(viewer, shown);
    this.send(viewer, encode.event({ id: ++this.events, time_s: this.timeS, level: "info", text: "a viewer came" }));
    this.send(viewer, encode.event({ id: ++this.events, time_s: this.timeS, level: "warning", text: "12 frames were dropped: the disk was slow" }));
    this.send(viewer, occupancyTile());
    this.publishState();
  }

  private send(viewer: Viewer, payload: encode.Payload): void {
    if (viewer.socket.readyState === viewer.socket.OPEN) viewer.socket.send(encode.frame(payload, ++viewer.sequence, BigInt(Math.round(this.timeS * 1e9))));
  }

  private broadcast(payload: encode.Payload): void {
    for (const viewer of this.viewers) if (viewer.ready) this.send(viewer, payload);
  }

  private sendPage(viewer: Viewer, { page, version }: ShownPage): void {
    const origin = page.key.map(value => value * this.sideM) as [number, number, number];
    for (const level of [2, 0, 1]) {
      ++this.sent.pages;
      this.send(viewer, encode.meshPage({ key: page.key, version, level, hasColors: true, origin, quantum: this.sideM / 30000, ageS: 0 }, page.levels[level]));
    }
  }

  /** Pages that the camera has come near to are there. */
  private reveal(): void {
    const place = cameraAt(this.timeS).position;
    for (const page of this.house) {
      const name = page.key.join();
      if (this.shown.has(name) || (this.share < 1 && distanceTo(page, this.sideM, place) > 1.2 + 2.2 * this.share)) continue;
      const shown = { page, version: 1 };
      this.shown.set(name, shown);
      for (const viewer of this.viewers) if (viewer.ready) this.sendPage(viewer, shown);
    }
  }

  private step(dtS: number): void {
    if (!this.replay.paused) this.timeS += dtS * this.replay.speed;
    const { position, yaw } = cameraAt(this.timeS);
    this.broadcast(encode.pose(0, 0, 0.01 + 0.004 * Math.sin(this.timeS), position, lookAlong(yaw), [0.5, 0.4]));
    this.vehicle?.step(dtS);
    if (this.vehicle) this.broadcast(this.vehicle.pose());
  }

  private publishState(): void {
    const replay = { time_s: this.timeS, begin_s: 0, end_s: 60, ...this.replay };
    const vehicle = this.vehicle?.telemetry(this.holder ? "page" : null);
    this.broadcast(encode.telemetry({ ...telemetryAt(this.timeS, this.share), ...(this.options.replay ? { replay } : {}), ...(vehicle ? { vehicle } : {}) }));
    this.broadcast(encode.statistics(statisticsAt(this.timeS, this.share)));
    const points = trajectory(Math.min(this.timeS + 4, 20));
    this.broadcast(encode.path(0, 0, points.length / 3, points));
    const keys = points.filter((_, i) => Math.floor(i / 3) % 8 === 0);
    this.broadcast(encode.path(1, 0, keys.length / 3, keys));
    for (const which of [0, 1]) this.broadcast(pictureAt(which, this.timeS));
  }

  private order(socket: WebSocket, command: PilotCommand): void {
    if (command.type === "take" && (!this.holder || command.force)) this.give(socket);
    else if (command.type === "take") this.tellLease();
    if (command.type === "release" && this.holder === socket) this.give(null);
    if (command.type !== "command" || !this.vehicle) return;
    const allowed = command.kind === "e_stop" || this.holder === socket;
    const { accepted, reason, plan } = allowed ? this.vehicle.act(command) : { accepted: false, reason: "another pilot flies", plan: undefined };
    if (plan) this.broadcast(plan);
    socket.send(JSON.stringify({ type: "answer", sequence: command.sequence, accepted, reason }));
  }

  private give(socket: WebSocket | null): void {
    this.holder = socket;
    this.tellLease();
  }

  private tellLease(): void {
    for (const socket of this.pilots)
      socket.send(JSON.stringify({ type: "lease", holder: this.holder === null ? "none" : this.holder === socket ? "you" : "other" }));
  }
}

function answerHttp(files: Map<string, Buffer>, fixture: Fixture, request: IncomingMessage, response: ServerResponse): void {
  const path = new URL(request.url ?? "/", "http://page").pathname.slice(1) || "index.html", file = files.get(path);
  if (path === "test/state") {
    response.writeHead(200, { "Content-Type": "application/json" }).end(JSON.stringify({ ...fixture.sent, vehicle: fixture.vehicle?.telemetry(null), heldAfterMs: fixture.vehicle?.heldAfterMs }));
  } else if (path.startsWith("api/")) {
    response.writeHead(200, { ...HEADERS, "Content-Type": "application/octet-stream" }).end(`made up: ${path}\n`);
  } else if (file) {
    response.writeHead(200, { ...HEADERS, "Content-Type": TYPES[path.split(".").pop()!] }).end(file);
  } else {
    response.writeHead(404).end("there is no such file\n");
  }
}

/** Serves until the process is ended; prints the address. */
export async function serve(files: Map<string, Buffer>, words: string[]): Promise<void> {
  const { values } = parseArgs({ args: words, options: {
    help: { type: "boolean" }, port: { type: "string", default: "0" }, grow: { type: "string", default: "0" }, voxel: { type: "string", default: "0.05" },
    step: { type: "string", default: "0.05" }, session: { type: "string", default: "made-up" }, pilot: { type: "boolean", default: false }, replay: { type: "boolean", default: false },
  } });
  if (values.help) {
    console.log(HELP);
    return;
  }
  await MeshoptEncoder.ready;
  const house = await makeHouse(Number(values.voxel), Number(values.step));
  const fixture = new Fixture(house, { growS: Number(values.grow), voxelM: Number(values.voxel), session: values.session!, pilot: values.pilot!, replay: values.replay! });
  const server = createServer((request, response) => answerHttp(files, fixture, request, response));
  const sockets = new WebSocketServer({ noServer: true, perMessageDeflate: false });
  server.on("upgrade", (request, socket, head) => sockets.handleUpgrade(request, socket, head, client => {
    if (request.url?.startsWith("/pilot")) fixture.pilot(client);
    else fixture.view(client);
  }));
  server.listen(Number(values.port), "127.0.0.1", () => console.log(`http://127.0.0.1:${(server.address() as AddressInfo).port}/`));
}
