import { LiveClient, type LiveListener, type LinkState } from "./live/live_client.ts";
import type { LinkCounts, OpenEdges, ShownFrame, TileFrontiers } from "./live/worker_messages.ts";
import { ModelStage } from "./model_stage.ts";
import { EventPanel } from "./panels/event_panel.ts";
import { byId, element } from "./panels/dom.ts";
import { startHelp } from "./panels/help_dialog.ts";
import { PictureStrip } from "./panels/picture_strip.ts";
import { PilotPanel } from "./panels/pilot_panel.ts";
import { PlotPanel } from "./panels/plot_panel.ts";
import { ReplayBar } from "./panels/replay_bar.ts";
import { startShortcuts } from "./panels/shortcuts.ts";
import { Status } from "./panels/status.ts";
import { Tabs } from "./panels/tabs.ts";
import { cssColor, startTheme } from "./panels/theme.ts";
import type { Hello } from "./protocol/messages.ts";
import { PlanView } from "./scene/plan_view.ts";
import { webGl2Of } from "./scene/scene_view.ts";

const VIEW_EVERY_MS = 250, SLOWLY_EVERY_MS = 500, WIDE_PX = 900;

/** The address of a WebSocket of the server, with the page's token. */
function socketUrl(path: string): string {
  return `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${path}${location.search}`;
}

/** Wires the link, the model and the panels. */
export class App implements LiveListener {
  counts: LinkCounts = { bytes: 0, frames: 0, skipped: 0, refused: 0, outdated: 0 };
  /** Null without WebGL 2: then there is a plan. */
  readonly stage: ModelStage | null;
  readonly plan: PlanView | null;
  private readonly tabs = new Tabs();
  private readonly events = new EventPanel();
  private readonly plots = new PlotPanel();
  private readonly pictures = new PictureStrip();
  private readonly replay: ReplayBar;
  private readonly status: Status;
  private readonly client = new LiveClient("live_worker.js", socketUrl("/live"), this);
  private pilot: PilotPanel | null = null;
  private viewSent = "";

  constructor() {
    this.replay = new ReplayBar(change => this.client.send({ type: "replay", ...change }));
    this.status = new Status(() => this.client.retry());
    this.client.start();  // first: the server answers while the model's view is made
    this.stage = webGl2Of(byId("model")) ? new ModelStage() : null;
    this.plan = this.stage ? null : showPlanInstead();
    if (this.stage) {
      this.tabs.add({ name: "View", page: this.stage.viewPanel.page });
      this.tabs.add({ name: "Measure", page: this.stage.measurePanel.page });
    }
    this.tabs.add({ name: "Plots", page: this.plots.page, onShow: shown => this.plots.setShown(shown) });
    this.tabs.add({ name: "Events", page: this.events.page });
    this.tabs.show(innerWidth > WIDE_PX ? (this.stage ? "View" : "Plots") : null);
  }

  start(): void {
    const flip = startTheme(() => {
      this.stage?.view.setBackground(cssColor("--scene"));
      this.plan?.requestDraw();
      this.plots.draw();
    });
    startShortcuts({ ...this.stage?.keys(), "?": startHelp(), p: () => this.replay.toggle(), l: flip }, () => {
      this.pilot?.stop();
      return this.pilot !== null;
    });
    setInterval(() => this.sendView(), VIEW_EVERY_MS);
    setInterval(() => this.updateSlowly(), SLOWLY_EVERY_MS);
  }

  onFrame(frame: ShownFrame, receivedMs: number): void {
    (this.stage?.view ?? this.plan)!.show(frame, receivedMs);
    const nowS = performance.now() / 1000;
    switch (frame.kind) {
      case "hello": this.greet(frame.hello); break;
      case "pose":
        this.status.pose(frame.pose);
        this.plots.pose(nowS, frame.pose);
        this.pilot?.pose(frame.pose);
        break;
      case "telemetry":
        this.status.update(frame.telemetry);
        this.stage?.measurePanel.setEnded(frame.telemetry.state === "finished" || frame.telemetry.state === "failed");
        this.replay.update(frame.telemetry.replay);
        this.plots.telemetry(nowS, frame.telemetry);
        if (frame.telemetry.vehicle) this.pilot?.update(frame.telemetry.vehicle);
        break;
      case "plan": this.pilot?.plan(frame.plan); break;
      case "event": this.events.add(frame.event); break;
      case "picture": this.pictures.show(frame.picture); break;
      case "statistics": this.plots.statistics(nowS, frame.statistics); break;
    }
  }

  onOpenEdges(pages: readonly OpenEdges[]): void { this.stage?.view.showOpenEdges(pages); }
  onFrontiers(tiles: readonly TileFrontiers[]): void { (this.stage?.view ?? this.plan)!.showFrontiers(tiles); }
  onCleared(): void {
    this.stage?.clear();
    this.plan?.clear();
    this.events.clear();
  }
  onState(state: LinkState): void {
    this.status.link(state);
    this.viewSent = "";
  }
  onCounts(counts: LinkCounts): void {
    this.counts = counts;
    this.plots.received(counts);
  }

  private greet(hello: Hello): void {
    this.status.hello(hello);
    this.stage?.measurePanel.setExports(hello.can.exports ?? [], location.search);
    if (hello.can.pilot && !this.pilot) this.startPilot();
  }

  private startPilot(): void {
    const pilot = new PilotPanel(socketUrl("/pilot"));
    this.pilot = pilot;
    this.tabs.add({ name: "Fly", page: pilot.page });
    if (innerWidth > WIDE_PX) this.tabs.show("Fly");
    this.stage?.flyWith(pilot);
  }

  /** The server sends first what is near and ahead. */
  private sendView(): void {
    const text = this.stage && JSON.stringify({ type: "view", ...this.stage.looksFrom() });
    if (!text || text === this.viewSent) return;
    this.viewSent = text;
    this.client.send(JSON.parse(text));
  }

  private updateSlowly(): void {
    this.stage?.updateSlowly();
    const view = this.stage?.view;
    this.status.size({
      triangles: (view?.mesh ?? this.plan)!.triangleCount, openM: view?.openEdges.lengthM() ?? 0, frontierM: (view?.frontiers ?? this.plan)!.lengthM(), voxelM: view?.mesh.voxelM ?? 0,
    });
    this.plots.draw();
  }
}

function showPlanInstead(): PlanView {
  const canvas = element("canvas", { id: "plan", "aria-label": "The model from above" });
  byId("model").replaceWith(canvas);
  const words = element("div", { class: "word", "data-level": "warning" }, element("span", { class: "mark", "aria-hidden": "true" }, "!"),
    element("span", {}, element("strong", {}, "No WebGL 2 here"), element("span", { class: "number" }, "This browser cannot draw the model in three dimensions. The plan, the plots and the events work.")));
  byId("words").before(words);
  return new PlanView(canvas);
}
