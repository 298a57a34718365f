import { Group } from "three";
import { byId, element } from "../panels/dom.ts";
import { length } from "../panels/numbers.ts";
import type { Vec3 } from "../protocol/frames.ts";
import { Dots } from "../scene/dots.ts";
import { Lines } from "../scene/lines.ts";
import type { SceneView } from "../scene/scene_view.ts";
import { distance, heightDifference, polygonArea, type Measured, type MeasuredPoint } from "./geometry.ts";
import { castRay, type RayLimits } from "./raycast.ts";
import { measureRoom } from "./room_size.ts";

export const TOOLS = ["distance", "height", "area", "room"] as const;
export type Tool = (typeof TOOLS)[number];

export interface Result { id: number; tool: Tool; texts: string[]; values: Measured[]; segments: number[]; label: Vec3 }

const TOUCH_PX = 4, SAME_POINT_M = 1e-3, EYE_ABOVE_FLOOR_M = 1.2;
const HINTS: Record<Tool, string[]> = {
  distance: ["Choose the first point", "Choose the second point"],
  height: ["Choose the first point", "Choose a higher or lower point"],
  area: ["Choose the first corner", "Choose the second corner", "Choose the third corner", "Choose more corners, or close the area"],
  room: ["Choose a point on the floor of the room"],
};

/** Measuring in the model: points chosen on the surface, results drawn and labelled. */
export class MeasureTool {
  tool: Tool | null = null;
  readonly results: Result[] = [];
  limits: () => RayLimits = () => ({});
  onChange: () => void = () => {};
  onTool: () => void = () => {};
  private points: MeasuredPoint[] = [];
  private nextId = 1;
  private readonly lines = new Lines({ color: "#ffe14d", widthPx: 3, onTop: true });
  private readonly dots = new Dots("#ffe14d", 11, true);
  private readonly labels = new Map<number, HTMLElement>();

  constructor(private readonly view: SceneView) {
    const group = new Group();
    group.add(this.lines, this.dots);
    view.overlay.add(group);
  }

  choose(tool: Tool | null): void {
    this.tool = tool;
    this.points = [];
    this.changed();
    this.onTool();
  }

  get hint(): string {
    if (!this.tool) return "";
    const hints = HINTS[this.tool];
    return hints[Math.min(this.points.length, hints.length - 1)];
  }
  get canClose(): boolean { return this.tool === "area" && this.points.length >= 3; }

  /** A click in the model; true where it was for this tool. */
  click(x: number, y: number): boolean {
    if (!this.tool) return false;
    const point = this.pointAt(x, y);
    if (point) this.add(point);
    return true;
  }

  /** As a click; the same point again closes an area. */
  pick(x: number, y: number): void {
    const last = this.points.at(-1)?.point, point = this.canClose ? this.pointAt(x, y)?.point : undefined;
    if (last && point?.every((value, k) => Math.abs(value - last[k]) < SAME_POINT_M)) this.close();
    else this.click(x, y);
  }

  close(): void {
    if (!this.canClose) return;
    const points = this.points, { value, sigma } = polygonArea(points, this.view.mesh.voxelM);
    const middle = [0, 1, 2].map(k => points.reduce((sum, { point }) => sum + point[k], 0) / points.length) as Vec3;
    this.keep("area", [`${value.toFixed(2)} m² ± ${sigma.toFixed(2)}`], [{ value, sigma }], loop(points.map(({ point }) => point)), middle);
  }

  remove(id: number): void {
    const at = this.results.findIndex(result => result.id === id);
    if (at >= 0) this.results.splice(at, 1);
    this.labels.get(id)?.remove();
    this.labels.delete(id);
    this.changed();
  }

  /** The labels follow the camera. */
  placeLabels(): void {
    for (const { id, label } of this.results) {
      const shown = this.labels.get(id)!, place = this.view.project(label), box = this.view.canvas.getBoundingClientRect();
      shown.hidden = !place;
      if (place) shown.style.transform = `translate(${place[0] - box.left}px, ${place[1] - box.top}px) translate(-50%, -130%)`;
    }
  }

  private pointAt(x: number, y: number): MeasuredPoint | null {
    const hit = castRay(this.view.mesh.pages(), this.view.rayAt(x, y), this.limits());
    const fingers = matchMedia("(pointer: coarse)").matches ? TOUCH_PX : 1;
    return hit && { ...hit, pixelM: fingers * this.view.pixelAt(hit.distanceM) };
  }

  private add(point: MeasuredPoint): void {
    this.points.push(point);
    const [a, b] = this.points;
    if (this.tool === "room") this.measureRoomAt(point);
    else if (this.tool === "distance" && b) {
      const measured = distance(a, b, this.view.mesh.voxelM);
      this.keep("distance", [withSigma(measured)], [measured], [...a.point, ...b.point], middleOf(a.point, b.point));
    } else if (this.tool === "height" && b) {
      const measured = heightDifference(a, b, this.view.mesh.voxelM), corner: Vec3 = [a.point[0], a.point[1], b.point[2]];
      this.keep("height", [withSigma(measured)], [measured], [...a.point, ...corner, ...corner, ...b.point], middleOf(a.point, corner));
    }
    this.changed();
  }

  private measureRoomAt({ point, normal }: MeasuredPoint): void {
    const center: Vec3 = normal[2] > 0.7 ? [point[0], point[1], point[2] + EYE_ABOVE_FLOOR_M] : [0, 1, 2].map(k => point[k] + normal[k]) as Vec3;
    const pages = [...this.view.mesh.pages()], room = measureRoom(ray => castRay(pages, ray), center, this.view.mesh.voxelM);
    const names = ["length", "width", "height"], texts = room.sizes.map((size, k) => `${names[k]} ${size ? withSigma(size) : "not closed"}`);
    const segments = room.ends.flatMap(ends => ends ? ends.flat() : []);
    this.keep("room", texts, room.sizes.flatMap(size => size ?? []), segments, center);
  }

  private keep(tool: Tool, texts: string[], values: Measured[], segments: number[], label: Vec3): void {
    const id = this.nextId++, shown = element("span", {}, texts.join(" · "));
    this.results.push({ id, tool, texts, values, segments, label });
    this.labels.set(id, shown);
    byId("labels").append(shown);
    this.points = [];
    this.changed();
  }

  private changed(): void {
    const open = this.points.slice(1).flatMap(({ point }, i) => [...this.points[i].point, ...point]);
    this.lines.setSegments(Float32Array.from([...this.results.flatMap(({ segments }) => segments), ...open]));
    this.dots.setPoints(Float32Array.from([...this.results.flatMap(({ segments }) => segments), ...this.points.flatMap(({ point }) => point)]));
    this.onChange();
    this.view.requestDraw();
  }
}

const withSigma = ({ value, sigma }: Measured): string => `${length(value)} ± ${(100 * sigma).toFixed(1)}\u202fcm`;
const middleOf = (a: Vec3, b: Vec3): Vec3 => [0, 1, 2].map(k => (a[k] + b[k]) / 2) as Vec3;
const loop = (points: Vec3[]): number[] => points.flatMap((point, i) => [...point, ...points[(i + 1) % points.length]]);
