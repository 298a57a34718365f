import { Color, Matrix4, OrthographicCamera, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "three";
import { PATH_NAMES, type Box, type Pose, type Vec3 } from "../protocol/frames.ts";
import type { OpenEdges, ShownFrame, TileFrontiers } from "../live/worker_messages.ts";
import { CameraRig, VIEW_SLOPE } from "./camera_rig.ts";
import { DetailPace, type Change } from "./detail_pace.ts";
import { Dots } from "./dots.ts";
import { GridLayer } from "./grid_layer.ts";
import { Latency } from "./latency.ts";
import { Lines, viewSize } from "./lines.ts";
import { MeshLayer } from "../mesh/mesh_layer.ts";
import { OpenEdgeLayer } from "./open_edge_layer.ts";
import { PathStore } from "./path_store.ts";
import { PoseMarks } from "./pose_marks.ts";

export const LAYERS = ["mesh", "trajectory", "keyframes", "truth", "way points", "open borders", "scan", "obstacles", "plan", "occupancy", "frontiers", "pose"] as const;
export type Layer = (typeof LAYERS)[number];

function join(a: Box | null, b: Box | null): Box | null {
  if (!a || !b) return a ?? b;
  return { low: a.low.map((value, k) => Math.min(value, b.low[k])) as Vec3, high: a.high.map((value, k) => Math.max(value, b.high[k])) as Vec3 };
}

/** The canvas's WebGL 2, the same at each call; null without it. A second one, to try whether there is any, takes 0.1 s and more where software draws. */
export function webGl2Of(canvas: HTMLCanvasElement): WebGL2RenderingContext | null {
  return canvas.getContext("webgl2", { antialias: true, powerPreference: "high-performance" });
}

/** Everything in three dimensions. Draws only when something changed. Needs WebGL 2: the constructor throws without it. */
export class SceneView {
  readonly rig = new CameraRig();
  readonly mesh: MeshLayer;
  readonly grid = new GridLayer();
  readonly paths = new PathStore();
  readonly openEdges = new OpenEdgeLayer();
  readonly frontiers = new OpenEdgeLayer(3);
  readonly overlay = new Scene();  // measurements, previews: what others add
  /** Called before each picture; what is moving returns true to be drawn again. */
  onFrame: (dtS: number) => boolean = () => false;
  /** Called after each picture. */
  onDrawn: () => void = () => {};
  lastPose: Pose | null = null;
  frames = 0;
  readonly scriptMs: number[] = [];  // of the last pictures
  readonly latency = new Latency();
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly perspective = new PerspectiveCamera(50, 1, 0.05, 500);
  private readonly orthographic = new OrthographicCamera(-1, 1, 1, -1, -500, 500);
  private readonly marks = new PoseMarks();
  private readonly lines: Record<string, Lines> = {
    trajectory: new Lines({ color: "#ff8a3d", widthPx: 2.5 }), truth: new Lines({ color: "#b9b9c6", widthPx: 1.5 }),
    "way points": new Lines({ color: "#c792ea", widthPx: 2 }), plan: new Lines({ color: "#35c9e8", widthPx: 4 }),
  };
  private readonly dots: Record<string, Dots> = {
    keyframes: new Dots("#ffd166", 7), scan: new Dots("#ff5db1", 4), obstacles: new Dots("#ff3b30", 9, true),
  };
  private change: Change = "moved";  // since the last picture
  private drawing: WebGLSync | null = null;  // the last picture, until the graphics card has finished it
  private readonly pace = new DetailPace();
  private lastS = 0;
  private readonly stalePaths = new Set<number>();

  constructor(readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, context: webGl2Of(canvas)! });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.autoClear = false;
    this.mesh = new MeshLayer(this.gl());
    this.renderer.resetState();
    canvas.addEventListener("webglcontextrestored", () => this.requestDraw());
    this.scene.add(this.grid.group, this.marks.group, this.openEdges.lines, this.frontiers.lines, ...Object.values(this.lines), ...Object.values(this.dots), this.overlay);
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
    requestAnimationFrame(time => this.step(time));
  }

  requestDraw(): void { this.change = "moved"; }

  setBackground(color: string): void {
    this.renderer.setClearColor(new Color(color));
    this.requestDraw();
  }

  setVisible(layer: Layer, visible: boolean): void {
    const named: Record<string, { visible: boolean }> = {
      mesh: this.mesh, occupancy: this.grid.group, pose: this.marks.group, "open borders": this.openEdges.lines, frontiers: this.frontiers.lines,
    };
    const target = named[layer] ?? this.lines[layer];
    if (target) target.visible = visible;
    else this.dots[layer].material.visible = visible;
    this.requestDraw();
  }

  /** Shows a frame that was received at a time of sharedClockMs(). */
  show(frame: ShownFrame, receivedMs: number): void {
    this.latency.note(frame, receivedMs, this.mesh);
    switch (frame.kind) {
      case "meshPage": this.mesh.set(frame.page); break;
      case "pageGone": this.mesh.remove(frame.gone.key); break;
      case "pose": this.showPose(frame.pose); break;
      case "path":
        this.paths.set(frame.path);
        this.stalePaths.add(frame.path.which);
        break;
      case "scan": this.dots[frame.scan.which === "laser" ? "scan" : "obstacles"].setPoints(frame.scan.points); break;
      case "plan": this.lines.plan.setLine(frame.plan.points); break;
      case "gridTile": this.grid.set(frame.tile); break;
      default: return;
    }
    if (frame.kind === "meshPage" || frame.kind === "pageGone") this.requestGrown();
    else this.requestDraw();
  }

  showOpenEdges(pages: readonly OpenEdges[]): void {
    for (const { key, ends } of pages) this.openEdges.set(key, ends);
    this.requestGrown();
  }

  showFrontiers(tiles: readonly TileFrontiers[]): void {
    for (const { key, ends } of tiles) this.frontiers.set(key, ends);
    this.requestDraw();
  }

  clear(): void {
    this.mesh.clear();
    this.grid.clear();
    this.paths.clear();
    this.openEdges.clear();
    this.frontiers.clear();
    PATH_NAMES.forEach((_, which) => this.stalePaths.add(which));
    Object.values(this.dots).forEach(dots => dots.setPoints(new Float32Array(0)));
    this.lines.plan.setLine([]);
    this.marks.hide();
    this.lastPose = null;
    this.requestDraw();
  }

  /** The box of the mesh, or of occupancy and paths where there is none. */
  box(): Box | null { return this.mesh.box() ?? join(this.grid.box(), this.paths.box()); }

  fit(): void {
    const box = this.box();
    if (box) this.rig.fit(box, this.canvas.clientWidth / Math.max(this.canvas.clientHeight, 1));
    this.requestDraw();
  }

  /** Origin and unit direction of the ray through a point of the canvas, pixels of the page. */
  rayAt(x: number, y: number): { origin: Vec3; direction: Vec3 } {
    const box = this.canvas.getBoundingClientRect(), { right, up, ahead } = this.rig.basis(), eye = this.rig.eye();
    const half = VIEW_SLOPE, across = (2 * (x - box.left) / box.width - 1) * half * box.width / box.height;
    const above = (1 - 2 * (y - box.top) / box.height) * half;
    if (this.rig.mode === "plan") {
      const start = [0, 1, 2].map(k => this.rig.target[k] + this.rig.distance * (right[k] * across + up[k] * above) - 200 * ahead[k]);
      return { origin: start as Vec3, direction: ahead };
    }
    const way = [0, 1, 2].map(k => ahead[k] + right[k] * across + up[k] * above), length = Math.hypot(...way);
    return { origin: eye, direction: way.map(v => v / length) as Vec3 };
  }

  /** Metres that a pixel covers at this distance from the eye. */
  pixelAt(distanceM: number): number {
    const distance = this.rig.mode === "plan" ? this.rig.distance : distanceM;
    return 2 * VIEW_SLOPE * distance / Math.max(this.canvas.clientHeight, 1);
  }

  /** Where a point of the model is on the page, or null where it is behind the camera. */
  project(point: Vec3): [number, number] | null {
    const place = new Vector3(...point).project(this.camera()), box = this.canvas.getBoundingClientRect();
    if (place.z > 1) return null;
    return [box.left + (place.x + 1) / 2 * box.width, box.top + (1 - place.y) / 2 * box.height];
  }

  /** The present view as a PNG, in every detail. */
  picture(): Promise<Blob | null> {
    this.mesh.finestOnly = true;
    this.draw();
    this.mesh.finestOnly = false;
    this.requestDraw();
    return new Promise(done => this.canvas.toBlob(done, "image/png"));
  }

  private requestGrown(): void {
    if (this.change === "none") this.change = "grown";
  }

  private gl(): WebGL2RenderingContext { return this.renderer.getContext() as WebGL2RenderingContext; }

  private showPose(pose: Pose): void {
    this.marks.set(pose);
    this.lastPose = pose;
    if (this.rig.mode === "follow") this.rig.target = pose.position;
  }

  private camera(): PerspectiveCamera | OrthographicCamera { return this.rig.mode === "plan" ? this.orthographic : this.perspective; }

  private step(time: number): void {
    requestAnimationFrame(next => this.step(next));
    const started = performance.now(), dtS = Math.min(Math.max(time / 1000 - this.lastS, 0), 0.1);
    this.lastS = time / 1000;
    if (this.onFrame(dtS)) this.requestDraw();
    if (this.isDrawing()) return;
    const coarseness = this.pace.begin(this.change, started);
    if (coarseness === null) return;
    this.draw(coarseness);
    this.fence();
    this.scriptMs.push(performance.now() - started);
    if (this.scriptMs.length > 600) this.scriptMs.splice(0, 300);
  }

  /** A picture begun before the last one is finished would block the page, buttons and all, where graphics are slow. */
  private isDrawing(): boolean {
    const gl = this.gl();
    if (!this.drawing || gl.getSyncParameter(this.drawing, gl.SYNC_STATUS) === gl.UNSIGNALED) return this.drawing !== null;
    gl.deleteSync(this.drawing);
    this.drawing = null;
    this.latency.finished();
    this.pace.finished(performance.now());
    return false;
  }

  private fence(): void {
    const gl = this.gl();
    this.drawing = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
  }

  /** The model's triangles may have sides this many times as long as in a fine picture. */
  private draw(coarseness = 1): void {
    this.change = "none";
    for (const which of this.stalePaths) this.drawPath(which);
    this.stalePaths.clear();
    this.openEdges.update();
    this.frontiers.update();
    this.placeCamera();
    this.renderer.clear();
    const camera = this.camera(), eye = this.rig.eye();
    const toClip = new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).elements, pixelM = coarseness * this.pixelAt(1);
    this.mesh.draw(this.rig.mode === "plan" ? { toClip, eye: [eye[0], eye[1], eye[2] + 1000], pixelAt: () => pixelM } : { toClip, eye, pixelAt: distanceM => pixelM * distanceM });
    this.renderer.resetState();
    this.renderer.render(this.scene, camera);
    ++this.frames;
    this.latency.drawn();
    this.onDrawn();
  }

  private drawPath(which: number): void {
    const points = this.paths.points(which), name = PATH_NAMES[which];
    if (name === "keyframes") this.dots.keyframes.setPoints(points);
    else this.lines[name].setLine(points);
  }

  private placeCamera(): void {
    const { rig } = this, camera = this.camera(), eye = rig.eye(), { up, ahead } = rig.basis();
    const aspect = this.canvas.clientWidth / Math.max(this.canvas.clientHeight, 1), half = VIEW_SLOPE * rig.distance;
    camera.position.set(...eye);
    camera.up.set(...up);
    camera.lookAt(eye[0] + ahead[0], eye[1] + ahead[1], eye[2] + ahead[2]);
    if (camera instanceof OrthographicCamera) Object.assign(camera, { left: -half * aspect, right: half * aspect, top: half, bottom: -half });
    else Object.assign(camera, { aspect, near: Math.max(rig.mode === "walk" ? 0.03 : rig.distance / 200, 0.02), far: rig.distance * 20 + 200 });
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    this.renderer.getDrawingBufferSize(viewSize.value);
    this.draw();
  }
}
