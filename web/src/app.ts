import { LiveClient, type LiveListener, type LinkState } from "./live/live_client.ts";
import type { LinkCounts, ShownFrame } from "./live/worker_messages.ts";
import { castRay } from "./measure/raycast.ts";
import { EventPanel } from "./panels/event_panel.ts";
import { byId, choice, element } from "./panels/dom.ts";
import { PictureStrip } from "./panels/picture_strip.ts";
import { ReplayBar } from "./panels/replay_bar.ts";
import { Status } from "./panels/status.ts";
import { Tabs } from "./panels/tabs.ts";
import { cssColor, startTheme } from "./panels/theme.ts";
import { ViewPanel } from "./panels/view_panel.ts";
import type { PageKey, Vec3 } from "./protocol/frames.ts";
import type { Hello } from "./protocol/messages.ts";
import { CAMERA_MODES, type CameraMode } from "./scene/camera_rig.ts";
import { Controls } from "./scene/controls.ts";
import { SceneView } from "./scene/scene_view.ts";

const VIEW_EVERY_MS = 250, SLOWLY_EVERY_MS = 500;

/** The address of a WebSocket of the server, with the page's token. */
export function socketUrl(path: string): string {
  return `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${path}${location.search}`;
}

/** Wires the link, the model and the panels. */
export class App implements LiveListener {
  private readonly tabs = new Tabs();
  private readonly events = new EventPanel();
  private readonly pictures = new PictureStrip();
  private readonly replay = new ReplayBar(change => this.client.send({ type: "replay", ...change }));
  private readonly status = new Status(() => this.client.retry());
  private readonly client = new LiveClient("live_worker.js", socketUrl("/live"), this);
  private readonly view: SceneView;
  private readonly viewPanel: ViewPanel;
  private readonly controls: Controls;
  private readonly cameras = choice("Camera", CAMERA_MODES, "orbit", mode => this.setCamera(mode));
  private fitted = false;  // the view shows the whole model until the person moves it
  private moved = false;
  private viewSent = "";
  counts: LinkCounts = { bytes: 0, frames: 0, skipped: 0, refused: 0, outdated: 0 };

  constructor() {
    this.view = new SceneView(byId<HTMLCanvasElement>("model"));
    this.viewPanel = new ViewPanel(this.view);
    this.controls = new Controls(this.view, {
      onClick: () => {}, onDoubleClick: (x, y) => this.lookAt(x, y), surfaceAt: (x, y) => this.surfaceAt(x, y)?.point ?? null,
      onMoved: () => { this.moved = true; },
    });
    this.view.onFrame = dtS => this.controls.step(dtS);
    byId("cameras").append(this.cameras.row, element("button", { type: "button", onclick: () => this.fit() }, "Whole model"));
    this.tabs.add({ name: "View", page: this.viewPanel.page });
    this.tabs.add({ name: "Events", page: this.events.page });
    this.tabs.show(innerWidth > 900 ? "View" : null);
  }

  start(): void {
    startTheme(() => this.view.setBackground(cssColor("--scene")));
    setInterval(() => this.sendView(), VIEW_EVERY_MS);
    setInterval(() => this.updateSlowly(), SLOWLY_EVERY_MS);
    this.client.start();
    Object.assign(window, { housemartin: this });  // for tests and the curious
  }

  onFrame(frame: ShownFrame): void {
    this.view.show(frame);
    switch (frame.kind) {
      case "hello": this.greet(frame.hello); break;
      case "pose": this.status.pose(frame.pose); break;
      case "telemetry":
        this.status.update(frame.telemetry);
        this.replay.update(frame.telemetry.replay);
        break;
      case "event": this.events.add(frame.event); break;
      case "picture": this.pictures.show(frame.picture); break;
    }
  }

  onOpenEdges(key: PageKey, ends: Float32Array): void { this.view.showOpenEdges(key, ends); }
  onCleared(): void {
    this.view.clear();
    this.events.clear();
    this.fitted = this.moved = false;
  }
  onState(state: LinkState): void {
    this.status.link(state);
    this.viewSent = "";
  }
  onCounts(counts: LinkCounts): void { this.counts = counts; }

  private greet(hello: Hello): void { this.status.hello(hello); }

  private setCamera(mode: CameraMode): void {
    this.view.rig.setMode(mode);
    if (mode === "plan") this.fit();
    this.view.requestDraw();
  }

  private fit(): void {
    this.view.fit();
    this.moved = false;
  }

  private surfaceAt(x: number, y: number) {
    return castRay(this.view.mesh.pages(), this.view.rayAt(x, y), this.viewPanel.clipHeightM);
  }

  /** The surface under the pointer becomes what the camera turns about; in `walk` the camera goes there. */
  private lookAt(x: number, y: number): void {
    const surface = this.surfaceAt(x, y);
    if (!surface) return;
    const { rig } = this.view;
    if (rig.mode === "walk") rig.standAt([surface.point[0], surface.point[1], surface.point[2] + (surface.normal[2] > 0.7 ? 1.6 : 0)]);
    else {
      const distance = Math.max(surface.distanceM, 0.3);
      if (rig.mode === "orbit") rig.distance = Math.min(rig.distance, distance);
      rig.target = surface.point;
    }
    this.moved = true;
    this.view.requestDraw();
  }

  /** The server sends first what is near and ahead. */
  private sendView(): void {
    const round = (v: Vec3): number[] => v.map(value => Math.round(1000 * value) / 1000);
    const text = JSON.stringify({ type: "view", position: round(this.view.rig.eye()), direction: round(this.view.rig.basis().ahead) });
    if (text === this.viewSent) return;
    this.viewSent = text;
    this.client.send(JSON.parse(text));
  }

  private updateSlowly(): void {
    const box = this.view.box();
    if (box) {
      this.viewPanel.setHeights(box.low[2], box.high[2]);
      if (!this.moved || !this.fitted) this.view.fit();
      this.fitted = true;
    }
    this.status.size(this.view.mesh.triangleCount, this.view.openEdges.lengthM());
    if (this.view.mesh.passTime()) this.view.requestDraw();
  }
}
