import type { ShownFrame, TileFrontiers } from "../live/worker_messages.ts";
import { cssColor } from "../panels/theme.ts";
import { PATH_NAMES, type GridTile, type Pose } from "../protocol/frames.ts";
import type { MeshPage } from "../protocol/mesh_page.ts";
import { lengthOf, UNSEEN_COLOR } from "./open_edge_layer.ts";
import { PathStore } from "./path_store.ts";

const MOST_POINTS_A_PAGE = 300, MARGIN_PX = 30;
/** Surface between these heights over the model's lowest point shows walls without floor and ceiling, m. */
const WALLS: [number, number] = [0.4, 1.8];

/** Some points (x, y, z) of the finest level of a page that has come. */
interface PlanPage { version: number; level: number; triangles: number; points: Float32Array }

/** The model from above on a flat canvas, for browsers without WebGL 2: walls as points, occupancy, paths, poses. */
export class PlanView {
  readonly paths = new PathStore();
  private readonly pages = new Map<string, PlanPage>();
  private readonly tiles = new Map<string, { tile: GridTile; image: HTMLCanvasElement }>();
  private readonly frontiers = new Map<string, Float32Array>();  // of each tile
  private readonly poses = new Map<string, Pose>();
  private plan: Float32Array = new Float32Array(0);
  private lowest = Infinity;
  private zoom = 1;
  private shift: [number, number] = [0, 0];
  private dirty = true;

  constructor(private readonly canvas: HTMLCanvasElement) {
    new ResizeObserver(() => this.requestDraw()).observe(canvas);
    canvas.addEventListener("wheel", event => {
      event.preventDefault();
      this.zoom *= Math.exp(-0.0012 * event.deltaY);
      this.requestDraw();
    }, { passive: false });
    canvas.addEventListener("pointermove", event => {
      if (event.buttons === 0) return;
      this.shift = [this.shift[0] + event.movementX, this.shift[1] + event.movementY];
      this.requestDraw();
    });
    const step = (): void => {
      if (this.dirty) this.draw();
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  get triangleCount(): number { return [...this.pages.values()].reduce((sum, { triangles }) => sum + triangles, 0); }
  requestDraw(): void { this.dirty = true; }

  show(frame: ShownFrame): void {
    if (frame.kind === "meshPage") this.addPage(frame.page);
    else if (frame.kind === "pageGone") this.pages.delete(frame.gone.key.join());
    else if (frame.kind === "gridTile") this.tiles.set(frame.tile.key.join(), { tile: frame.tile, image: imageOf(frame.tile) });
    else if (frame.kind === "path") this.paths.set(frame.path);
    else if (frame.kind === "pose") this.poses.set(frame.pose.which, frame.pose);
    else if (frame.kind === "plan") this.plan = frame.plan.points;
    else return;
    this.requestDraw();
  }

  showFrontiers(tiles: readonly TileFrontiers[]): void {
    for (const { key, ends } of tiles) this.frontiers.set(key.join(), ends);
    this.requestDraw();
  }

  /** Metres of frontiers. */
  lengthM(): number { return [...this.frontiers.values()].reduce((sum, ends) => sum + lengthOf(ends), 0); }

  clear(): void {
    [this.pages, this.tiles, this.frontiers, this.poses].forEach(all => all.clear());
    this.paths.clear();
    this.plan = new Float32Array(0);
    this.lowest = Infinity;
    this.requestDraw();
  }

  private addPage(page: MeshPage): void {
    const name = page.key.join(), old = this.pages.get(name);
    if (old && old.version === page.version && old.level < page.level) return;
    const count = page.positions.length / 4, step = Math.max(1, Math.ceil(count / MOST_POINTS_A_PAGE)), points: number[] = [];
    for (let i = 0; i < count; i += step) for (let k = 0; k < 3; ++k) points.push(page.origin[k] + page.quantum * page.positions[4 * i + k]);
    this.pages.set(name, { version: page.version, level: page.level, triangles: page.indices.length / 3, points: Float32Array.from(points) });
    this.lowest = Math.min(this.lowest, page.low[2]);
  }

  private draw(): void {
    this.dirty = false;
    const { canvas } = this, context = canvas.getContext("2d")!, scale = devicePixelRatio;
    canvas.width = Math.round(canvas.clientWidth * scale);
    canvas.height = Math.round(canvas.clientHeight * scale);
    const toCanvas = this.projection();
    if (!toCanvas) return;
    for (const { tile, image } of this.tiles.values()) {
      const size = tile.side * tile.cellM, [left, bottom] = toCanvas(tile.key[0] * size, tile.key[1] * size), [right, top] = toCanvas((tile.key[0] + 1) * size, (tile.key[1] + 1) * size);
      context.imageSmoothingEnabled = false;
      context.drawImage(image, left, top, right - left, bottom - top);
    }
    this.drawFrontiers(context, toCanvas);
    context.fillStyle = cssColor("--ink");
    for (const { points } of this.pages.values())
      for (let i = 0; i < points.length; i += 3) {
        const height = points[i + 2] - this.lowest;
        if (height > WALLS[0] && height < WALLS[1]) context.fillRect(...toCanvas(points[i], points[i + 1]), 2, 2);
      }
    PATH_NAMES.forEach((name, which) => { if (name !== "keyframes") this.line(context, this.paths.points(which), cssColor(`--s${which + 1}`), toCanvas); });
    this.line(context, this.plan, cssColor("--s6"), toCanvas);
    for (const pose of this.poses.values()) this.mark(context, pose, toCanvas);
  }

  /** From metres to pixels of the canvas; null while there is nothing. */
  private projection(): ((x: number, y: number) => [number, number]) | null {
    let [low, high] = [[Infinity, Infinity], [-Infinity, -Infinity]];
    const include = (x: number, y: number): void => {
      low = [Math.min(low[0], x), Math.min(low[1], y)];
      high = [Math.max(high[0], x), Math.max(high[1], y)];
    };
    for (const { points } of this.pages.values()) for (let i = 0; i < points.length; i += 3) include(points[i], points[i + 1]);
    const box = this.paths.box();
    if (box) [box.low, box.high].forEach(point => include(point[0], point[1]));
    if (low[0] > high[0]) return null;
    const { width, height } = this.canvas, scale = devicePixelRatio;
    const fit = Math.min((width - 2 * MARGIN_PX * scale) / Math.max(high[0] - low[0], 1), (height - 2 * MARGIN_PX * scale) / Math.max(high[1] - low[1], 1)) * this.zoom;
    const middle = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2];
    return (x, y) => [width / 2 + (x - middle[0]) * fit + this.shift[0] * scale, height / 2 - (y - middle[1]) * fit + this.shift[1] * scale];
  }

  private line(context: CanvasRenderingContext2D, points: Float32Array, color: string, toCanvas: (x: number, y: number) => [number, number]): void {
    context.strokeStyle = color;
    context.lineWidth = 2 * devicePixelRatio;
    context.beginPath();
    for (let i = 0; i < points.length; i += 3) context.lineTo(...toCanvas(points[i], points[i + 1]));
    context.stroke();
  }

  private drawFrontiers(context: CanvasRenderingContext2D, toCanvas: (x: number, y: number) => [number, number]): void {
    context.strokeStyle = UNSEEN_COLOR;
    context.lineWidth = 3 * devicePixelRatio;
    context.beginPath();
    for (const ends of this.frontiers.values())
      for (let i = 0; i < ends.length; i += 6) {
        context.moveTo(...toCanvas(ends[i], ends[i + 1]));
        context.lineTo(...toCanvas(ends[i + 3], ends[i + 4]));
      }
    context.stroke();
  }

  private mark(context: CanvasRenderingContext2D, pose: Pose, toCanvas: (x: number, y: number) => [number, number]): void {
    context.fillStyle = cssColor(pose.state === "lost" ? "--bad" : "--accent");
    context.beginPath();
    context.arc(...toCanvas(pose.position[0], pose.position[1]), 6 * devicePixelRatio, 0, 2 * Math.PI);
    context.fill();
  }
}

/** Free cells light, occupied ones dark; what is unknown is left out. Rows of the picture go downwards. */
function imageOf({ side, cells }: GridTile): HTMLCanvasElement {
  const canvas = document.createElement("canvas"), context = canvas.getContext("2d")!, image = context.createImageData(side, side);
  canvas.width = canvas.height = side;
  cells.forEach((value, i) => {
    const at = 4 * ((side - 1 - Math.floor(i / side)) * side + i % side);
    image.data.set(value > 127 ? [217, 84, 20, 230] : [110, 175, 225, value > 0 ? 70 : 0], at);
  });
  context.putImageData(image, 0, 0);
  return canvas;
}
