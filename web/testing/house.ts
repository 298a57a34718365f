/** A made-up house: rooms as boxes seen from inside, with doors and windows as holes, cut into pages. */
import { MeshoptSimplifier } from "meshoptimizer";
import type { PageKey, Vec3 } from "../src/protocol/frames.ts";
import type { Surface, Vertex } from "./encode.ts";

export interface Room { low: Vec3; high: Vec3; wall: Vec3; floor: Vec3 }
interface Hole { low: Vec3; high: Vec3 }
export interface HousePage { key: PageKey; levels: Surface[] }  // finest first

/** Inner sizes: 4 x 3 x 2.6 m, 3.2 x 3 x 2.6 m, 7.4 x 2.4 x 2.6 m. */
export const ROOMS: Room[] = [
  { low: [0, 0, 0], high: [4, 3, 2.6], wall: [222, 214, 196], floor: [150, 108, 72] },
  { low: [4.2, 0, 0], high: [7.4, 3, 2.6], wall: [186, 206, 214], floor: [126, 132, 138] },
  { low: [0, 3.2, 0], high: [7.4, 5.6, 2.6], wall: [206, 216, 190], floor: [164, 128, 92] },
];
const HOLES: Hole[] = [
  { low: [2.6, 2.8, -0.1], high: [3.6, 3.4, 2] }, { low: [5, 2.8, -0.1], high: [6, 3.4, 2] },
  { low: [1, -0.2, 0.9], high: [2.4, 0.2, 2] }, { low: [7.2, 1, 0.9], high: [7.6, 2.2, 2] },
  { low: [3, 5.4, 0.9], high: [4.4, 5.8, 2] }, { low: [6.4, 3.4, -0.1], high: [7, 4, 0.1] },
];

/** All pages; `stepM`: side of the squares that walls are made of. */
export async function makeHouse(voxelM: number, stepM: number): Promise<HousePage[]> {
  await MeshoptSimplifier.ready;
  const builder = new PageBuilder(32 * voxelM);
  for (const room of ROOMS)
    for (let axis = 0; axis < 3; ++axis)
      for (const side of [0, 1]) addWall(builder, room, axis, side, stepM);
  return builder.pages();
}

function addWall(builder: PageBuilder, room: Room, axis: number, side: number, stepM: number): void {
  const [a, b] = [(axis + 1) % 3, (axis + 2) % 3], at = side ? room.high[axis] : room.low[axis];
  const normal: Vec3 = [0, 0, 0];
  normal[axis] = side ? -1 : 1;
  const na = Math.round((room.high[a] - room.low[a]) / stepM), nb = Math.round((room.high[b] - room.low[b]) / stepM);
  const corner = (i: number, j: number): Vec3 => {
    const point: Vec3 = [0, 0, 0];
    point[axis] = at;
    point[a] = room.low[a] + i * (room.high[a] - room.low[a]) / na;
    point[b] = room.low[b] + j * (room.high[b] - room.low[b]) / nb;
    return point;
  };
  for (let i = 0; i < na; ++i)
    for (let j = 0; j < nb; ++j) {
      const corners = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
      const middle = [0, 1, 2].map(k => (corners[0][k] + corners[2][k]) / 2);
      if (HOLES.some(hole => middle.every((value, k) => value > hole.low[k] && value < hole.high[k]))) continue;
      builder.addSquare(side ? corners.reverse() : corners, middle as Vec3, normal, point => colorOf(room, axis, side, point));
    }
}

function colorOf(room: Room, axis: number, side: number, [x, y, z]: Vec3): Vec3 {
  const base: Vec3 = axis === 2 ? (side ? [240, 238, 232] : room.floor) : room.wall;
  const stripe = axis === 2 && !side ? 16 * Math.sin(26 * y + Math.sin(3 * x)) : axis < 2 && z < 0.12 ? -60 : 5 * Math.sin(9 * x) * Math.sin(8 * y) * Math.sin(7 * z);
  return base.map(value => Math.max(0, Math.min(255, Math.round(value + stripe)))) as Vec3;
}

class PageBuilder {
  private readonly made = new Map<string, { key: PageKey; surface: Surface; known: Map<string, number> }>();

  constructor(private readonly sideM: number) {}

  addSquare(corners: Vec3[], middle: Vec3, normal: Vec3, color: (point: Vec3) => Vec3): void {
    const key = middle.map((value, k) => Math.floor((value + 1e-4 * normal[k]) / this.sideM)) as PageKey, name = key.join();
    const page = this.made.get(name) ?? { key, surface: { vertices: [], indices: [] }, known: new Map<string, number>() };
    this.made.set(name, page);
    const at = corners.map(point => {
      const place = point.map(value => Math.round(1e4 * value)).join(), known = page.known.get(place);
      if (known !== undefined) return known;
      const vertex: Vertex = { point, normal, color: color(point), errorM: 0.002 + 0.004 * Math.abs(Math.sin(point[0] + 2 * point[1])) };
      page.known.set(place, page.surface.vertices.length);
      return page.surface.vertices.push(vertex) - 1;
    });
    page.surface.indices.push(at[0], at[1], at[2], at[0], at[2], at[3]);
  }

  pages(): HousePage[] {
    return [...this.made.values()].map(({ key, surface }) => ({ key, levels: [surface, simplify(surface, 0.25), simplify(surface, 0.06)] }));
  }
}

/** Fewer triangles; open borders stay as they are. */
function simplify({ vertices, indices }: Surface, share: number): Surface {
  const points = Float32Array.from(vertices.flatMap(vertex => vertex.point)), target = 3 * Math.ceil(indices.length * share / 3);
  const [kept] = MeshoptSimplifier.simplify(Uint32Array.from(indices), points, 3, target, 0.05, ["LockBorder"]);
  const used = new Map<number, number>(), fewer: Vertex[] = [];
  const renamed = Array.from(kept, index => {
    const known = used.get(index) ?? fewer.push(vertices[index]) - 1;
    used.set(index, known);
    return known;
  });
  return { vertices: fewer, indices: renamed };
}
