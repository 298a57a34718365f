import { castRay } from "./measure/raycast.ts";
import { MeasureTool } from "./measure/measure_tool.ts";
import { byId, choice, element } from "./panels/dom.ts";
import { MeasurePanel } from "./panels/measure_panel.ts";
import type { PilotPanel } from "./panels/pilot_panel.ts";
import { ViewPanel } from "./panels/view_panel.ts";
import type { Vec3 } from "./protocol/frames.ts";
import { CAMERA_MODES, type CameraMode } from "./scene/camera_rig.ts";
import { Controls } from "./scene/controls.ts";
import { Crosshair } from "./scene/crosshair.ts";
import { SceneView } from "./scene/scene_view.ts";

const EYE_HEIGHT_M = 1.6;

/** The model in three dimensions with its cameras and tools. */
export class ModelStage {
  readonly view = new SceneView(byId<HTMLCanvasElement>("model"));
  readonly measure = new MeasureTool(this.view);
  readonly viewPanel = new ViewPanel(this.view);
  readonly measurePanel = new MeasurePanel(this.measure, () => void this.savePicture());
  private readonly cameras = choice("Camera", CAMERA_MODES, "orbit", mode => this.setCamera(mode));
  private readonly controls: Controls;
  private readonly crosshair = new Crosshair(this.view.canvas);
  private pilot: PilotPanel | null = null;
  private moved = false;  // until then the whole model is shown while it grows

  constructor() {
    this.controls = new Controls(this.view, {
      onClick: (x, y) => this.click(x, y), onDoubleClick: (x, y) => this.lookAt(x, y), surfaceAt: (x, y) => this.surfaceAt(x, y)?.point ?? null,
      onMoved: () => { this.moved = true; },
    });
    this.measure.onTool = () => this.updateCrosshair();
    this.measure.limits = () => this.viewPanel.limits;
    this.view.onFrame = dtS => this.controls.step(dtS);
    this.view.onDrawn = () => this.measure.placeLabels();
    byId("cameras").append(this.cameras.row, element("button", { type: "button", title: "Show the whole model (F)", onclick: () => this.fit() }, "Whole"));
  }

  flyWith(pilot: PilotPanel): void {
    this.pilot = pilot;
    pilot.onKeysTaken = taken => { this.controls.keysTaken = taken; };
    pilot.onChoosing = () => this.updateCrosshair();
  }

  /** Keys of the whole page. */
  keys(): Record<string, () => void> {
    const cameras = Object.fromEntries(CAMERA_MODES.map((mode, i) => [String(i + 1), () => this.setCamera(mode)]));
    return {
      ...cameras, f: () => this.fit(), c: () => this.viewPanel.nextMode(), m: () => this.measure.choose("distance"), Escape: () => this.leave(), Enter: () => this.chooseByKey(),
    };
  }

  clear(): void {
    this.view.clear();
    this.moved = false;
  }

  looksFrom(): { position: number[]; direction: number[] } {
    const round = (v: Vec3): number[] => v.map(value => Math.round(1000 * value) / 1000);
    return { position: round(this.view.rig.eye()), direction: round(this.view.rig.basis().ahead) };
  }

  updateSlowly(): void {
    const box = this.view.box();
    if (!box) return;
    this.viewPanel.setHeights(box.low[2], box.high[2]);
    if (!this.moved) this.view.fit();
    if (this.view.mesh.mode === "age") this.view.requestDraw();  // ages pass
  }

  private setCamera(mode: CameraMode): void {
    this.cameras.choose(mode);
    this.view.rig.setMode(mode);
    if (mode === "plan") this.fit();
    if (mode === "walk") this.enter();
    if (mode === "follow") [this.moved, this.view.rig.distance] = [true, Math.min(this.view.rig.distance, 5)];
    this.view.requestDraw();
  }

  private fit(): void {
    this.view.fit();
    this.moved = false;
  }

  /** Walking starts where the camera of the scan is, or in the middle of the model, on its feet. */
  private enter(): void {
    const box = this.view.box();
    if (!box) return;
    const middle = [0, 1].map(k => (box.low[k] + box.high[k]) / 2), at = this.view.lastPose?.position ?? [middle[0], middle[1], box.low[2] + EYE_HEIGHT_M];
    this.view.rig.distance = 1;
    this.view.rig.standAt([at[0], at[1], at[2]]);
    this.moved = true;
  }

  private surfaceAt(x: number, y: number) {
    return castRay(this.view.mesh.pages(), this.view.rayAt(x, y), this.viewPanel.limits);
  }

  private leave(): void {
    this.measure.choose(null);
    if (this.pilot?.choosing) this.pilot.choose(false);
  }

  private updateCrosshair(): void { this.crosshair.want(this.measure.tool !== null || this.pilot?.choosing === true); }

  /** Chooses what is in the middle of the view; an area is closed by choosing its last corner twice. */
  private chooseByKey(): void {
    if (!this.crosshair.shown) this.measure.close();
    else if (this.pilot?.choosing) this.click(...this.crosshair.place());
    else this.measure.pick(...this.crosshair.place());
  }

  private click(x: number, y: number): void {
    if (this.pilot?.choosing) this.chooseGoal(this.pilot, x, y);
    else this.measure.click(x, y);
  }

  /** Over the surface, or on the slice of occupancy where there is none. */
  private chooseGoal(pilot: PilotPanel, x: number, y: number): void {
    const surface = this.surfaceAt(x, y), free = surface ? null : this.view.grid.meet(this.view.rayAt(x, y));
    if (surface) pilot.preview(surface.point, surface.normal);
    else if (free) pilot.preview(free, null);
  }

  /** The surface under the pointer becomes what the camera turns about; in `walk` the camera goes there. */
  private lookAt(x: number, y: number): void {
    const surface = this.measure.tool || this.pilot?.choosing ? null : this.surfaceAt(x, y);
    if (!surface) return;
    const { rig } = this.view, [px, py, pz] = surface.point;
    if (rig.mode === "walk") rig.standAt([px, py, pz + (surface.normal[2] > 0.7 ? EYE_HEIGHT_M : 0)]);
    else rig.target = surface.point;
    if (rig.mode === "orbit") rig.distance = Math.min(rig.distance, Math.max(surface.distanceM, 0.3));
    this.moved = true;
    this.view.requestDraw();
  }

  private async savePicture(): Promise<void> {
    const picture = await this.view.picture();
    if (!picture) return;
    const url = URL.createObjectURL(picture);
    element("a", { href: url, download: "housemartin.png" }).click();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
  }
}
